import {DELTA_FACTOR} from "../model/constants.js";
import {fieldValue} from "../print/reference.js";

// Rays of THREE.Raycaster against a model, on the CPU.
const MOST_STEPS = 400;
const NEAREST_HIT = 1e-5, SMALLEST_STEP = 2e-4; // model units

/** Adds the nearest intersection of a ray with a mesh of createMesh. Scenes of several shapes have none.
 * @param {Three} THREE @param {Three} mesh @param {Model} model @param {Three} caster @param {object[]} hits */
export function castRay(THREE, mesh, model, caster, hits) {
    if (model.field) return;
    const {ray: {origin, direction}, near, far} = caster, matrix = new THREE.Matrix4().copy(mesh.matrixWorld);
    const inverse = matrix.invert ? matrix.invert() : new THREE.Matrix4().getInverse(mesh.matrixWorld);
    const start = origin.clone().applyMatrix4(inverse), end = origin.clone().add(direction).applyMatrix4(inverse);
    const along = end.sub(start), unit = along.length();
    const t = firstHit(model, start.toArray(), along.divideScalar(unit).toArray());
    if (t === null || t / unit < near || t / unit > far) return;
    hits.push({distance: t / unit, point: origin.clone().addScaledVector(direction, t / unit), object: mesh});
}

/** Returns the distance at which a ray meets the surface, by sphere tracing; null if it does not. direction: length
 * 1.
 * @param {Model} model @param {Vector} origin @param {Vector} direction */
function firstHit(model, origin, direction) {
    const dot = (/** @type {Vector} */ a, /** @type {Vector} */ b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
        along = dot(origin, direction);
    const radius = 1 + model.levels.at(-1).delta, inside = radius ** 2 - dot(origin, origin) + along ** 2;
    if (inside <= 0) return null;
    const end = Math.sqrt(inside) - along;
    let t = Math.max(-Math.sqrt(inside) - along, 0);
    for (let i = 0; i < MOST_STEPS && t <= end; ++i) {
        const [value, level] = fieldValue(model, origin.map((c, k) => c + t * direction[k]));
        const {delta, bounds} = model.levels[level - 1], isLast = level === model.levels.length;
        if (isLast && value < NEAREST_HIT) return t;
        const step = isLast ? bounds.step_bound * value : bounds.band_step_bound * (value - delta / DELTA_FACTOR);
        if (step < 0) return t;
        t += Math.max(step, SMALLEST_STEP);
    }
    return null;
}
