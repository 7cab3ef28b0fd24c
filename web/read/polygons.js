import {demandFew, Growing} from "./mesh_parts.js";

// Collects polygons as triangles: fans, and ears where a polygon is concave (Meisters 1975).
const MOST_CORNERS = 1000, MOST_CHECKS = 2e7; // polygons beyond stay fans

export class Polygons {
    constructor() {
        this.vertices = new Growing(Uint32Array); // of the corners of triangles
        this.places = new Growing(Int32Array); // of the corners in a table of texture coordinates; -1 for none
        this.normals = new Growing(Int32Array); // the same for normals; empty without a table
        this.materials = new Growing(Uint16Array); // of the triangles
        this.large = new Growing(Uint32Array); // first triangle and number of corners of polygons with over three
        this.checks = 0;
        this.normal = new Float64Array(3);
        this.corners = this.first = this.last = 0;
        this.firstPlace = this.lastPlace = -1;
        /** @type {number | null} */
        this.firstNormal = null;
        /** @type {number | null} */
        this.lastNormal = null;
    }

    /** Adds a corner to the polygon. @param {number} vertex @param {number} place in a table of texture coordinates
     * @param {number | null} normal in a table of normals */
    add(vertex, place = -1, normal = null) {
        if (this.corners === 0) {
            this.first = vertex;
            this.firstPlace = place;
            this.firstNormal = normal;
        } else if (this.corners > 1) {
            this.push(this.first, this.firstPlace, this.firstNormal);
            this.push(this.last, this.lastPlace, this.lastNormal);
            this.push(vertex, place, normal);
        }
        this.last = vertex;
        this.lastPlace = place;
        this.lastNormal = normal;
        ++this.corners;
    }

    /** @param {number} vertex @param {number} place @param {number | null} normal */
    push(vertex, place, normal) {
        this.vertices.push(vertex);
        this.places.push(place);
        if (normal !== null) this.normals.push(normal);
    }

    // Ends the polygon. material: its index.
    finish(material = 0) {
        const count = this.vertices.size / 3;
        demandFew(count, "triangles");
        if (this.corners > 3 && this.corners <= MOST_CORNERS) {
            this.large.push(count - this.corners + 2);
            this.large.push(this.corners);
        }
        this.materials.fill(material, count);
        this.corners = 0;
    }

    /** Cuts the concave polygons anew. @param {Float64Array} points coordinates of the vertices */
    cutEars(points) {
        const {array, size} = this.large;
        for (let i = 0; i < size && this.checks < MOST_CHECKS; i += 2) {
            if (this.isConcave(array[i], array[i + 1], points)) this.cut(array[i], array[i + 1], points);
        }
    }

    /** Whether a triangle of the fan has a normal against that of the polygon, which is set.
     * @param {number} first @param {number} count @param {Float64Array} points */
    isConcave(first, count, points) {
        const {normal} = this;
        let isAgainst = false;
        normal.fill(0);
        for (const isSecond of [false, true]) {
            const [nx, ny, nz] = normal;
            for (let i = first; i < first + count - 2; ++i) {
                const a = 3 * this.vertices.array[3 * i], b = 3 * this.vertices.array[3 * i + 1];
                const c = 3 * this.vertices.array[3 * i + 2];
                const ax = points[a], ay = points[a + 1], az = points[a + 2];
                const ux = points[b] - ax, uy = points[b + 1] - ay, uz = points[b + 2] - az;
                const vx = points[c] - ax, vy = points[c + 1] - ay, vz = points[c + 2] - az;
                const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
                if (isSecond) {
                    isAgainst ||= x * nx + y * ny + z * nz < 0;
                } else {
                    normal[0] += x;
                    normal[1] += y;
                    normal[2] += z;
                }
            }
        }
        return isAgainst;
    }

    /** @param {number} first @param {number} count @param {Float64Array} points */
    cut(first, count, points) {
        const [vertices, places, normals] = [this.vertices.array, this.places.array, this.normals.array];
        const ring = Array.from({length: count}, (_, k) => (k < 2 ? 3 * first + k : 3 * (first + k - 2) + 2));
        const sizes = Array.from(this.normal, Math.abs), axis = sizes.indexOf(Math.max(...sizes));
        const flat = ring.map((at) => { // the polygon in the plane, counterclockwise
            const of = 3 * vertices[at];
            return [points[of + (axis + 1) % 3], points[of + (axis + 2) % 3] * (this.normal[axis] < 0 ? -1 : 1)];
        });
        const old = ring.map((at) => [vertices[at], places[at], normals[at]]);
        this.ears(flat).forEach((k, i) => {
            const at = 3 * first + i;
            [vertices[at], places[at], normals[at]] = old[k];
        });
    }

    /** Returns the corners of triangles of a polygon. @param {number[][]} flat */
    ears(flat) {
        const left = flat.map((_, k) => k), found = /** @type {number[]} */ ([]);
        for (let k = 0, missed = 0; left.length > 3;) {
            k %= left.length;
            const ear = [/** @type {number} */ (left.at(k - 1)), left[k], left[(k + 1) % left.length]],
                isStuck = missed >= left.length;
            if (isStuck || this.isEar(flat, left, ear)) {
                found.push(...ear);
                left.splice(k, 1);
                if (!isStuck) missed = 0;
            } else {
                ++missed;
                ++k;
            }
        }
        return [...found, ...left];
    }

    /** @param {number[][]} flat @param {number[]} left @param {number[]} ear */
    isEar(flat, left, ear) {
        const [a, b, c] = ear.map((k) => flat[k]), isConvex = turned(a, b, c) > 0;
        this.checks += isConvex ? left.length : 1;
        return isConvex && !left.some((k) => {
            const p = flat[k], isCorner = [a, b, c].some((q) => q[0] === p[0] && q[1] === p[1]);
            return !isCorner && turned(a, b, p) >= 0 && turned(b, c, p) >= 0 && turned(c, a, p) >= 0;
        });
    }
}

/** Returns twice the signed area of a triangle. @param {number[]} a @param {number[]} b @param {number[]} c */
function turned(a, b, c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}
