// Shared by the readers of mesh files. A MeshError has a one-line message.
export class MeshError extends Error {}

// Throws a MeshError unless a condition holds.
export function demand(condition, message) {
    if (!condition) throw new MeshError(message);
}

// Collects triangles of polygons, as fans.
export class Faces {
    constructor(most = 1024) {
        this.array = new Uint32Array(3 * most);
        this.size = 0;
    }

    // Adds a polygon: indices of its corners.
    add(corners) {
        for (let k = 2; k < corners.length; ++k) {
            if (this.size + 3 > this.array.length) this.grow();
            this.array[this.size++] = corners[0];
            this.array[this.size++] = corners[k - 1];
            this.array[this.size++] = corners[k];
        }
    }

    grow() {
        const larger = new Uint32Array(2 * this.array.length);
        larger.set(this.array);
        this.array = larger;
    }

    get triangles() {
        return this.array.slice(0, this.size);
    }
}
