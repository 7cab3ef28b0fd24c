import {DISTANCE, NORMAL, SAMPLE} from "./kernel.js";
import {SurfaceColors} from "./surface_colors.js";
import {Tree} from "./tree.js";
import {Winding} from "./winding.js";

// A triangle mesh in model space, to train on (trainer/shapes/mesh.py): faces are flat.

export class Shape {
    // vertices: Float64Array (3 V); faces: Uint32Array (3 F); colors: of readShape (mesh_file.js), or null.
    constructor(vertices, faces, colors = null) {
        Object.assign(this, {vertices, faces, colors: colors && new SurfaceColors(colors, faces)});
        this.tree = new Tree(vertices, faces);
        this.winding = new Winding(this.tree);
        const count = faces.length / 3;
        this.normals = new Float64Array(3 * count);
        this.areas = new Float64Array(count); // cumulative
        for (let i = 0, sum = 0; i < count; ++i) this.areas[i] = sum += this.measure(i);
    }

    // Sets the normal of a face, and returns twice its area.
    measure(face) {
        const {vertices: v, faces, normals} = this;
        const [a, b, c] = [0, 1, 2].map((k) => 3 * faces[3 * face + k]);
        const u = [0, 1, 2].map((k) => v[b + k] - v[a + k]), w = [0, 1, 2].map((k) => v[c + k] - v[a + k]);
        const normal = [u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2], u[0] * w[1] - u[1] * w[0]];
        const length = Math.hypot(...normal);
        for (let k = 0; k < 3; ++k) normals[3 * face + k] = length > 0 ? normal[k] / length : 0;
        return length;
    }

    // Draws points of the surface as surface() does. Returns {rows, colors: Float32Array (3 count), sRGB}.
    coloredSurface(count, random) {
        const colors = new Float32Array(3 * count);
        return {rows: this.surface(count, random, colors), colors};
    }

    // Draws points of the surface, uniformly by area. Returns rows of samples with distance 0 and the faces' normals.
    // colors: an array for the points' colors, or null.
    surface(count, random, colors = null) {
        const {vertices: v, faces, normals, areas} = this, rows = new Float32Array(SAMPLE * count);
        for (let i = 0; i < count; ++i) {
            const face = placeOf(areas, random() * areas[areas.length - 1]);
            let s = random(), t = random();
            if (s + t > 1) [s, t] = [1 - s, 1 - t];
            const [a, b, c] = [0, 1, 2].map((k) => 3 * faces[3 * face + k]);
            for (let k = 0; k < 3; ++k) {
                rows[SAMPLE * i + k] = (1 - s - t) * v[a + k] + s * v[b + k] + t * v[c + k];
                rows[SAMPLE * i + NORMAL + k] = normals[3 * face + k];
            }
            if (colors) this.colors.write(face, s, t, colors, 3 * i);
        }
        return rows;
    }

    // Returns rows of every `step`-th vertex, from the `first` one on.
    corners(first, step) {
        const rows = new Float32Array(SAMPLE * Math.ceil((this.vertices.length / 3 - first) / step));
        for (let at = 0, i = first; at < rows.length; at += SAMPLE, i += step) {
            rows.set(this.vertices.subarray(3 * i, 3 * i + 3), at);
        }
        return rows;
    }

    // Sets the signed distances of rows of samples: negative where the winding number exceeds 1/2.
    setDistances(rows) {
        for (let at = 0; at < rows.length; at += SAMPLE) {
            rows[at + DISTANCE] = this.distance(rows[at], rows[at + 1], rows[at + 2]);
        }
    }

    distance(x, y, z) {
        this.tree.nearest(x, y, z);
        return Math.sqrt(this.tree.squared) * (this.winding.at(x, y, z) > 0.5 ? -1 : 1);
    }
}

// Returns the first place of a sorted array whose number exceeds a value.
export function placeOf(sorted, value) {
    let low = 0, high = sorted.length - 1;
    while (low < high) {
        const middle = (low + high) >> 1;
        if (sorted[middle] > value) high = middle;
        else low = middle + 1;
    }
    return low;
}
