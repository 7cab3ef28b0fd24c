import {Tree} from "./tree.js";

// The nearest points of a cloud, by the tree of boxes over them.
export class Neighbors {
    // points: Float64Array (3 N); most: largest number of neighbors that is asked for.
    constructor(points, most) {
        this.tree = new Tree(points, Uint32Array.from(points, (_, i) => Math.floor(i / 3))); // triangles of one corner
        this.squared = new Float64Array(most);
        this.index = new Uint32Array(most);
    }

    // Finds the `count` points nearest to a place: sets `index` and `squared`, the squared distances, nearest first.
    // Squared distances beyond the cloud's number of points are infinite.
    find(x, y, z, count) {
        const {tree, squared, index} = this, {stack, reach, first, size, order, vertices} = tree;
        let depth = 1;
        squared.fill(Infinity, 0, count);
        stack[0] = 0;
        reach[0] = tree.boxDistance(0, x, y, z);
        while (depth) {
            const node = stack[--depth], child = first[node];
            if (reach[depth] >= squared[count - 1]) continue;
            if (size[node]) {
                for (let i = child; i < child + size[node]; ++i) {
                    const at = 3 * order[i], dx = vertices[at] - x, dy = vertices[at + 1] - y;
                    const dz = vertices[at + 2] - z;
                    this.insert(order[i], dx * dx + dy * dy + dz * dz, count);
                }
                continue;
            }
            const one = tree.boxDistance(child, x, y, z), two = tree.boxDistance(child + 1, x, y, z);
            const far = one < two ? 1 : 0; // the nearer child is on top of the stack
            stack[depth] = child + far;
            reach[depth++] = Math.max(one, two);
            stack[depth] = child + 1 - far;
            reach[depth++] = Math.min(one, two);
        }
    }

    insert(point, distance, count) {
        const {squared, index} = this;
        if (distance >= squared[count - 1]) return;
        let place = count - 1;
        for (; place > 0 && squared[place - 1] > distance; --place) {
            squared[place] = squared[place - 1];
            index[place] = index[place - 1];
        }
        squared[place] = distance;
        index[place] = point;
    }
}
