import {GRADIENT, SAMPLE, VALUE} from "../kernel/kernel.js";
import {DELTA_FACTOR} from "../model/constants.js";

// Longest safe steps of sphere tracing, measured along rays: no step may pass through the shape (trainer/tracing.py).

// Measures the step bounds of each level where the last is traced, and the largest |grad f| along the rays.
// evaluate: fills value and gradient of the nested field (Eq. 3) at rows, and returns the level of each, from 0. deltas:
// of the levels; aims: rows on the surface; random: returns numbers in [0, 1); config: `TracingConfig` of
// trainer/measuring_config.py. Returns {bounds, steepest}.
export function traced(evaluate, deltas, aims, random, config) {
    const last = deltas.length - 1, offsets = deltas.map((delta, i) => (i < last ? delta / DELTA_FACTOR : 0));
    const bounds = deltas.map(() => 1);
    let rays = firstRays(evaluate, aims, random, config), steepest = 0;
    for (let round = 0, spread = 1; round <= config.rounds; ++round, spread /= 2) {
        const worst = deltas.map(() => []);
        for (const [ray, samples] of follow(evaluate, offsets, rays, 1 + deltas[last], config).entries()) {
            steepest = samples.reduce(
                (most, {level, slope}) => (level === last ? Math.max(most, slope) : most),
                steepest,
            );
            limits(samples, offsets, config.inside).forEach(({end, ratio}, level) => {
                bounds[level] = Math.min(bounds[level], ratio);
                if (Number.isFinite(ratio)) worst[level].push({ratio, end, ray: rays[ray]});
            });
        }
        rays = worst.flatMap((of) => of.sort((a, b) => a.ratio - b.ratio).slice(0, config.worst))
            .map(({end, ray: {aim, direction}}) =>
                varied(along(aim, direction, end), direction, spread, random, config)
            );
    }
    return {bounds: bounds.map((bound) => Math.max(config.least_bound, Math.floor(1000 * bound) / 1000)), steepest};
}

// Draws rays past points of the surface in all directions, and rays from points in the ball down to the surface.
function firstRays(evaluate, aims, random, config) {
    const within = new Float32Array(aims.length), rays = [];
    for (let at = 0; at < within.length; at += SAMPLE) {
        within.set(
            unitVector([normalNumber(random), normalNumber(random), normalNumber(random)], Math.cbrt(random())),
            at,
        );
    }
    evaluate(within);
    for (let at = 0; at < aims.length; at += SAMPLE) {
        const anywhere = [normalNumber(random), normalNumber(random), normalNumber(random)];
        const down = [...within.subarray(at + GRADIENT, at + GRADIENT + 3)].map((c) => -c);
        rays.push(varied([...aims.subarray(at, at + 3)], unitVector(anywhere), 1, random, config));
        rays.push(varied([...within.subarray(at, at + 3)], unitVector(down), 1, random, config));
    }
    return rays;
}

function varied(aim, direction, spread, random, {aside, turn}) {
    return {
        aim: aim.map((c) => c + spread * aside * normalNumber(random)),
        direction: unitVector(direction.map((c) => c + spread * turn * normalNumber(random))),
    };
}

// Samples the field along rays through the ball of a radius, densely where it is near zero. Returns for each ray its
// samples {t, f, level, slope}, in order.
function follow(evaluate, offsets, rays, radius, config) {
    const paths = rays.map(() => []),
        places = rays.map(({aim, direction}, ray) => {
            const middle = dotProduct(aim, direction),
                half = Math.sqrt(middle ** 2 - dotProduct(aim, aim) + radius ** 2);
            return {ray, t: -middle - half, far: half - middle};
        });
    let left = places.filter(({t, far}) => t < far);
    for (let count = 0; left.length && count < config.samples; ++count) {
        const rows = new Float32Array(SAMPLE * left.length);
        left.forEach(({ray, t}, i) => rows.set(along(rays[ray].aim, rays[ray].direction, t), SAMPLE * i));
        const levels = evaluate(rows);
        left.forEach((place, i) => {
            const at = SAMPLE * i,
                f = rows[at + VALUE],
                slope = Math.hypot(...rows.subarray(at + GRADIENT, at + GRADIENT + 3));
            paths[place.ray].push({t: place.t, f, level: levels[i], slope});
            const step = config.step_share * (Math.abs(f) - offsets[levels[i]]);
            place.t += Math.min(config.longest, Math.max(config.shortest, step));
        });
        left = left.filter(({t, far}) => t < far);
    }
    return paths;
}

// Finds, of each level, the sample outside the shape from which sphere tracing may step the least before it has passed
// through the next stretch inside. inside: share of that stretch that a step may reach. Returns {end, ratio} of each
// level: the place of that step's latest end, and its length relative to that of sphere tracing; else infinite.
function limits(samples, offsets, inside) {
    const found = offsets.map(() => ({end: 0, ratio: Infinity}));
    let end = null, exit = null;
    for (let i = samples.length - 1; i >= 0; --i) {
        const here = samples[i], next = samples[i + 1];
        if (next && here.f < 0 !== next.f < 0) {
            const share = here.level === next.level
                ? Math.abs(here.f) / Math.max(Math.abs(here.f) + Math.abs(next.f), 1e-30)
                : 0.5;
            const crossing = here.t + share * (next.t - here.t);
            if (here.f < 0) exit = crossing;
            else end = exit === null ? null : (1 - inside) * crossing + inside * exit;
        }
        const step = here.f - offsets[here.level];
        if (end === null || here.f < 0 || !(step > 0)) continue;
        const ratio = (end - here.t) / step;
        if (ratio < found[here.level].ratio) found[here.level] = {end, ratio};
    }
    return found;
}

const along = (aim, direction, t) => aim.map((c, k) => c + t * direction[k]);
const dotProduct = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

function unitVector(v, length = 1) {
    const factor = length / Math.max(Math.hypot(...v), 1e-12);
    return v.map((c) => c * factor);
}

// Draws a normal random number (Box and Muller).
function normalNumber(random) {
    return Math.sqrt(-2 * Math.log(1 - random())) * Math.cos(2 * Math.PI * random());
}
