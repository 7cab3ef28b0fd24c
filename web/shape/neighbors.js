import {Tree} from "./tree.js";

/** The nearest points of a cloud, by the tree of boxes over them. */
export class Neighbors {
    /** @param {Float64Array} points (3 N) @param {number} most largest number of neighbors that is asked for */
    constructor(points, most) {
        this.tree = new Tree(points, Uint32Array.from(points, (_, i) => Math.floor(i / 3))); // triangles of one corner
        this.squared = new Float64Array(most);
        this.index = new Uint32Array(most);
        this.count = most;
    }

    /** Finds the `count` points nearest to a place: sets `index` and `squared`, the squared distances, nearest first.
     * Squared distances beyond the cloud's number of points are infinite.
     * @param {number} x @param {number} y @param {number} z @param {number} count */
    find(x, y, z, count) {
        this.count = count;
        this.squared.fill(Infinity, 0, count);
        this.tree.descend(x, y, z, Infinity, this);
    }

    /** @param {number} point @param {number} x @param {number} y @param {number} z */
    visit(point, x, y, z) {
        const {squared, index, count, tree: {vertices}} = this, at = 3 * point;
        const distance = (vertices[at] - x) ** 2 + (vertices[at + 1] - y) ** 2 + (vertices[at + 2] - z) ** 2;
        let place = count - 1;
        if (distance >= squared[place]) return squared[place];
        for (; place > 0 && squared[place - 1] > distance; --place) {
            squared[place] = squared[place - 1];
            index[place] = index[place - 1];
        }
        squared[place] = distance;
        index[place] = point;
        return squared[count - 1];
    }
}
