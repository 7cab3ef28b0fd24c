import {demand, demandFew} from "./mesh_parts.js";
import {firstEqual} from "./places.js";

// Checks and merges the points of a cloud (trainer/shapes/checks.py, duplicates.py).
const FEWEST = 100, APART = 1e-6; // points this close, as a share of half the bounding box's diagonal, are one
const CANCELED = 0.1; // length of a mean normal below which the normals at one place contradict each other

// Returns {vertices, normals, tints, notes} of points with normals of any length; tints may be null. Leaves out points
// without a place or a normal, and averages those at one place.
export function cleanCloud(shape) {
    const notes = [], usable = withUnitNormals(shape);
    const lost = (shape.vertices.length - usable.vertices.length) / 3;
    if (lost) notes.push(`left out ${lost.toLocaleString("en")} points without finite coordinates or a normal`);
    demandFew(usable.vertices.length / 3, "points");
    const merged = mergedPoints(usable), count = merged.vertices.length / 3, less = usable.vertices.length / 3 - count;
    if (less) notes.push(`merged or left out ${less.toLocaleString("en")} points that share a place`);
    demand(count >= FEWEST, `${count} points at different places; a cloud needs at least ${FEWEST}`);
    return {...merged, notes};
}

function withUnitNormals({vertices, normals, tints}) {
    const lengths = Float64Array.from({length: vertices.length / 3}, (_, i) => {
        const isPlace = [0, 1, 2].every((k) => Math.abs(vertices[3 * i + k]) <= 1e100);
        return isPlace ? Math.hypot(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]) : 0;
    });
    const keep = (i) => lengths[Math.floor(i / 3)] > 0 && lengths[Math.floor(i / 3)] < Infinity;
    const kept = (array) => array && array.filter((_, i) => keep(i));
    return {vertices: kept(vertices), normals: kept(normals.map((c, i) => c / lengths[Math.floor(i / 3)])), tints: kept(tints)};
}

function mergedPoints({vertices, normals, tints}) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    vertices.forEach((c, i) => {
        low[i % 3] = Math.min(low[i % 3], c);
        high[i % 3] = Math.max(high[i % 3], c);
    });
    const cell = APART * Math.hypot(...low.map((c, k) => high[k] - c)) / 2;
    const first = firstEqual(vertices.map((c, i) => Math.floor((c - low[i % 3]) / cell)));
    const counts = new Uint32Array(first.length), means = new Float64Array(normals.length), colors = tints && new Float32Array(tints.length);
    first.forEach((to, i) => {
        ++counts[to];
        for (let k = 0; k < 3; ++k) {
            means[3 * to + k] += normals[3 * i + k];
            if (colors) colors[3 * to + k] += tints[3 * i + k];
        }
    });
    const lengths = Float64Array.from(counts, (_, i) => Math.hypot(means[3 * i], means[3 * i + 1], means[3 * i + 2]));
    const keep = (i) => counts[Math.floor(i / 3)] && lengths[Math.floor(i / 3)] >= CANCELED * counts[Math.floor(i / 3)];
    const kept = (array, value) => array.map(value).filter((_, i) => keep(i));
    return {
        vertices: kept(vertices, (c) => c), normals: kept(means, (c, i) => c / lengths[Math.floor(i / 3)]),
        tints: colors && kept(colors, (c, i) => c / counts[Math.floor(i / 3)]),
    };
}
