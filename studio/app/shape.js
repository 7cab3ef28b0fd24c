import {randomNumbers} from "./batches.js";
import {NORMAL, SAMPLE} from "./kernel.js";
import {demand} from "./mesh_parts.js";
import {Surface} from "./surface.js";
import {SurfaceColors} from "./surface_colors.js";
import {Tree} from "./tree.js";
import {Winding} from "./winding.js";

// A triangle mesh in model space, to train on (trainer/shapes/mesh.py): faces are flat.
const PROBES = 2000; // points below the surface, where a mesh must enclose some volume

export class Shape extends Surface {
    // vertices: Float64Array (3 V); faces: Uint32Array (3 F); colors: of readShape (mesh_file.js), or null.
    // Throws MeshError if the mesh encloses no volume.
    constructor(vertices, faces, colors = null) {
        super();
        this.isExact = true; // its distances
        Object.assign(this, {vertices, faces, colors: colors && new SurfaceColors(colors, faces)});
        this.tree = new Tree(vertices, faces);
        this.winding = new Winding(this.tree);
        const count = faces.length / 3;
        this.normal = new Float64Array(3);
        this.areas = new Float64Array(count); // cumulative
        for (let i = 0, sum = 0; i < count; ++i) this.areas[i] = sum += this.measure(i);
        this.demandVolume();
    }

    // Throws MeshError if no point just below the surface is inside the mesh.
    demandVolume() {
        const rows = this.surface(PROBES, randomNumbers(0));
        for (let at = 0; at < rows.length; at += SAMPLE) {
            const depth = 1e-4 * 3000 ** (at / rows.length);
            const below = (k) => rows[at + k] - depth * rows[at + NORMAL + k];
            if (this.winding.isInside(below(0), below(1), below(2))) return;
        }
        demand(false, "the mesh encloses no volume; use a closed surface, or: mplicits train --thicken T");
    }

    // Sets `normal` to that of a face, and returns twice its area.
    measure(face) {
        const {vertices: v, faces, normal} = this;
        const a = 3 * faces[3 * face], b = 3 * faces[3 * face + 1], c = 3 * faces[3 * face + 2];
        const ux = v[b] - v[a], uy = v[b + 1] - v[a + 1], uz = v[b + 2] - v[a + 2];
        const wx = v[c] - v[a], wy = v[c + 1] - v[a + 1], wz = v[c + 2] - v[a + 2];
        const nx = uy * wz - uz * wy, ny = uz * wx - ux * wz, nz = ux * wy - uy * wx;
        const length = Math.sqrt(nx * nx + ny * ny + nz * nz), factor = length > 0 ? 1 / length : 0;
        normal[0] = nx * factor;
        normal[1] = ny * factor;
        normal[2] = nz * factor;
        return length;
    }

    // Draws points of the surface, uniformly by area. Returns rows of samples with distance 0 and the faces' normals.
    // colors: an array for the points' colors, or null.
    surface(count, random, colors = null) {
        const {vertices: v, faces, normal, areas} = this, rows = new Float32Array(SAMPLE * count);
        for (let i = 0; i < count; ++i) {
            const face = placeOf(areas, random() * areas[areas.length - 1]);
            let s = random(), t = random();
            if (s + t > 1) [s, t] = [1 - s, 1 - t];
            const a = 3 * faces[3 * face], b = 3 * faces[3 * face + 1], c = 3 * faces[3 * face + 2];
            this.measure(face);
            for (let k = 0; k < 3; ++k) {
                rows[SAMPLE * i + k] = (1 - s - t) * v[a + k] + s * v[b + k] + t * v[c + k];
                rows[SAMPLE * i + NORMAL + k] = normal[k];
            }
            if (colors) this.colors.write(face, s, t, colors, 3 * i);
        }
        return rows;
    }

    // Returns the signed distance of a place: negative where the winding number exceeds 1/2.
    distance(x, y, z) {
        this.tree.nearest(x, y, z);
        return Math.sqrt(this.tree.squared) * (this.winding.isInside(x, y, z) ? -1 : 1);
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
