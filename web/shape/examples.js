/** @import {ShapeColors} from "../read/mesh_file.js" */

/** Places [x, y, z, ...color], and the corners of triangles. @typedef {{places: number[][], faces: number[]}} Sheets */

/** Shapes by code, to try the studio without a file. With y up. */
export const EXAMPLES = [{name: "rope", make: rope}, {name: "vase", make: vase}, {name: "gear", make: gear}];

const TURN = 2 * Math.PI;
const [INK, GOLD, CORAL, CREAM, TEAL] = ["104a68", "eeb63e", "d64541", "faecd6", "2b8c8c"].map((digits) => (
    [0, 2, 4].map((at) => Number.parseInt(digits.slice(at, at + 2), 16) / 255)
));

// The built-in shape of Python (trainer/shapes/demo.py): two striped strands and a string of beads, tied into a knot.
const RING = 1, SECTION = 0.5, ASIDE = 0.185, TWIST = 9, STRAND = 0.147, BEADS = 59;
const ALONG = 800, AROUND = 40, BEAD_ROWS = 15, BEAD_COLUMNS = 28, SMALL = 1e-4;

function rope() {
    const mesh = /** @type {Sheets} */ ({places: [], faces: []});
    /** @type {[Vector, Vector, number][]} */
    const strands = [[INK, GOLD, 24], [CORAL, CREAM, -36]];
    for (const [strand, [ground, stripe, turns]] of strands.entries()) {
        const frames = Array.from({length: ALONG}, (_, j) => tubeFrame(strand, TURN * j / ALONG));
        addSheet(mesh, AROUND, ALONG, false, (i, j) => {
            const angle = TURN * i / AROUND, {center, side, up} = frames[j];
            const wave = Math.min(Math.max((Math.sin(turns * TURN * j / ALONG + 2 * angle) - 0.1) / 0.7, 0), 1);
            const out = shifted(scaled(side, STRAND * Math.cos(angle)), up, STRAND * Math.sin(angle));
            return [...shifted(center, out, 1), ...mixed(ground, stripe, wave * wave * (3 - 2 * wave))];
        });
    }
    evenPlaces(BEADS, (t) => strandAt(2, t).center).forEach((center, bead) => {
        const color = bead % 3 ? CREAM : GOLD;
        addSheet(mesh, BEAD_COLUMNS, BEAD_ROWS, true, (i, j) => {
            const across = TURN * i / BEAD_COLUMNS, down = Math.PI * j / (BEAD_ROWS - 1), ring = Math.sin(down);
            const normal = [ring * Math.cos(across), ring * Math.sin(across), -Math.cos(down)];
            return [...shifted(center, normal, STRAND), ...color];
        });
    });
    return meshOf(mesh, true);
}

/** Returns the center of a strand at t, and the unit vector to it from the rope's axis, a (2, 3) torus knot.
 * @param {number} strand @param {number} t */
function strandAt(strand, t) {
    const axis = (/** @type {number} */ at) => {
        const ring = RING + SECTION * Math.cos(3 * at);
        return [ring * Math.cos(2 * at), ring * Math.sin(2 * at), SECTION * Math.sin(3 * at)];
    };
    const around = [Math.cos(3 * t) * Math.cos(2 * t), Math.cos(3 * t) * Math.sin(2 * t), Math.sin(3 * t)];
    const across = cross(direction(axis, t), around), angle = TWIST * t + TURN * strand / 3;
    const outward = shifted(scaled(around, Math.cos(angle)), across, Math.sin(angle));
    return {center: shifted(axis(t), outward, ASIDE), outward};
}

/** @param {number} strand @param {number} t */
function tubeFrame(strand, t) {
    const {center, outward} = strandAt(strand, t), along = direction((at) => strandAt(strand, at).center, t);
    const side = unit(shifted(outward, along, -dot(outward, along)));
    return {center, side, up: cross(along, side)};
}

/** Returns points of a closed curve at equal distances along it.
 * @param {number} count @param {(t: number) => Vector} curve */
function evenPlaces(count, curve) {
    const steps = 4096, lengths = [0];
    const points = Array.from({length: steps + 1}, (_, i) => curve(TURN * i / steps));
    for (let i = 1; i <= steps; ++i) {
        lengths.push(lengths[i - 1] + Math.hypot(...shifted(points[i], points[i - 1], -1)));
    }
    return Array.from({length: count}, (_, i) => {
        const far = i / count * lengths[steps], k = lengths.findIndex((length) => length > far);
        return mixed(points[k - 1], points[k], (far - lengths[k - 1]) / (lengths[k] - lengths[k - 1]));
    });
}

// A thin-walled vase with twisted flutes.
const FLUTES = 9, FLUTE = 0.07, WALL = 0.05, STEPS = 120, VASE_COLUMNS = 288;

function vase() {
    const mesh = /** @type {Sheets} */ ({places: [], faces: []});
    /** @type {{ring: number, s: number, isInside?: boolean}[]} */
    const profile = [];
    const radius = (/** @type {number} */ s) => 0.44 + 0.24 * Math.sin(0.35 + 4.6 * s) - 0.06 * s;
    const floor = 0.04; // share of the height
    for (let k = 0; k < 12; ++k) profile.push({ring: radius(0) * k / 12, s: 0});
    for (let k = 0; k <= STEPS; ++k) profile.push({ring: radius(k / STEPS), s: k / STEPS});
    for (let k = STEPS; k >= 0; --k) {
        const s = floor + (1 - floor) * k / STEPS;
        profile.push({ring: radius(s) - WALL, s, isInside: true});
    }
    for (let k = 11; k >= 0; --k) profile.push({ring: (radius(floor) - WALL) * k / 12, s: floor, isInside: true});
    addSheet(mesh, VASE_COLUMNS, profile.length, true, (i, j) => {
        const {ring, s, isInside} = profile[j], angle = TURN * i / VASE_COLUMNS;
        const wave = Math.cos(FLUTES * (angle + 1.1 * s)), far = ring * (1 + FLUTE * wave);
        const glaze = mixed(mixed(INK, TEAL, s), CREAM, Math.max(0, wave) ** 3 * 0.8);
        return [far * Math.sin(angle), 2 * s - 1, far * Math.cos(angle), ...(isInside ? CREAM : glaze)];
    });
    return meshOf(mesh, true);
}

// A gear with a thin web and a hub: flat faces and sharp edges.
const TEETH = 18;
const TOOTH = [[0, 0.84], [0.2, 0.84], [0.29, 0.92], [0.4, 1], [0.6, 1], [0.71, 0.92], [0.8, 0.84]]; // [share, radius]
/** [radius, or null for the teeth; z], counter-clockwise. @type {[number | null, number][]} */
const SECTION_OF_GEAR = [
    [0.16, -0.24],
    [0.32, -0.24],
    [0.36, -0.08],
    [0.64, -0.08],
    [0.68, -0.18],
    [null, -0.18],
    [null, 0.18],
    [0.68, 0.18],
    [0.64, 0.08],
    [0.36, 0.08],
    [0.32, 0.24],
    [0.16, 0.24],
];

function gear() {
    const mesh = /** @type {Sheets} */ ({places: [], faces: []});
    addSheet(mesh, TEETH * TOOTH.length, SECTION_OF_GEAR.length, false, (i, j) => {
        const [share, rim] = TOOTH[i % TOOTH.length], angle = TURN * (Math.floor(i / TOOTH.length) + share) / TEETH;
        const [radius, z] = SECTION_OF_GEAR[j], far = radius ?? rim;
        return [far * Math.cos(angle), far * Math.sin(angle), z];
    });
    return meshOf(mesh, false);
}

/** Adds a closed surface of columns x rows places. Columns wrap around, and rows do, unless `hasPoles`: then the first
 * and the last row are one vertex each. at: returns the place of a column and a row; seen from outside, with columns to
 * the right, rows go up. @param {Sheets} mesh @param {number} columns @param {number} rows @param {boolean} hasPoles
 * @param {(column: number, row: number) => number[]} at */
function addSheet({places, faces}, columns, rows, hasPoles, at) {
    const rings = Array.from({length: rows}, (_, j) => {
        const size = hasPoles && j % (rows - 1) === 0 ? 1 : columns;
        return Array.from({length: size}, (_, i) => places.push(at(i, j)) - 1);
    });
    for (let j = 0; j < rows - (hasPoles ? 1 : 0); ++j) {
        const one = rings[j], other = rings[(j + 1) % rows];
        for (let i = 0; i < columns; ++i) {
            const [a, b] = [0, 1].map((k) => one[(i + k) % one.length]);
            const [d, c] = [0, 1].map((k) => other[(i + k) % other.length]);
            if (one.length > 1) faces.push(a, b, c);
            if (other.length > 1) faces.push(a, c, d);
        }
    }
}

/** @param {Sheets} mesh @param {boolean} hasColors */
function meshOf({places, faces}, hasColors) {
    const vertex = Float32Array.from(places.flatMap((place) => place.slice(3)));
    return {
        vertices: Float64Array.from(places.flatMap((place) => place.slice(0, 3))),
        faces: Uint32Array.from(faces),
        colors: hasColors ? {vertex, uv: null, material: null, materials: []} : null,
    };
}

/** @param {(t: number) => Vector} curve @param {number} t */
function direction(curve, t) {
    return unit(shifted(curve(t + SMALL), curve(t - SMALL), -1));
}

/** @type {(a: Vector, b: Vector) => number} */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @type {(a: Vector, factor: number) => Vector} */
const scaled = (a, factor) => a.map((c) => c * factor);
/** @type {(a: Vector, along: Vector, by: number) => Vector} */
const shifted = (a, along, by) => a.map((c, k) => c + by * along[k]);
/** @type {(a: Vector) => Vector} */
const unit = (a) => scaled(a, 1 / Math.hypot(...a));
/** @type {(a: Vector, b: Vector) => Vector} */
const cross = (a, b) => [0, 1, 2].map((k) => a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]);
/** @type {(a: Vector, b: Vector, share: number) => Vector} */
const mixed = (a, b, share) => a.map((c, k) => c * (1 - share) + b[k] * share);
