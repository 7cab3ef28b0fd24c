// Evaluates the field in double precision on the CPU. The page compares the shader of a dropped model with it.
const TOGETHER = 4; // points with interleaved sums, so that no addition waits for the previous one

/** Returns a network's values at `count` points, a multiple of TOGETHER. h: x of all points, then y of all points,
 * ...
 * @param {Network} network @param {Float64Array} h @param {number} count */
function networkValues(network, h, count) {
    network.forEach(({rows, columns, weight, bias}, j) => {
        const next = new Float64Array(rows * count), bend = j < network.length - 1 ? Math.sin : Number;
        for (let o = 0; o < rows; ++o) {
            for (let k = 0; k < count; k += TOGETHER) {
                let a = bias[o], b = a, c = a, d = a;
                for (let w = o * columns, end = w + columns, i = k; w < end; ++w, i += count) {
                    const factor = weight[w];
                    a += factor * h[i];
                    b += factor * h[i + 1];
                    c += factor * h[i + 2];
                    d += factor * h[i + 3];
                }
                const at = o * count + k;
                next[at] = bend(a);
                next[at + 1] = bend(b);
                next[at + 2] = bend(c);
                next[at + 3] = bend(d);
            }
        }
        h = next;
    });
    return h;
}

/** Returns the values of a model's network at points [x, y, z] and a time.
 * @param {Pick<Model, "inputs">} model @param {Network} network @param {Vector[]} points @param {number} time */
export function valuesAt({inputs}, network, points, time) {
    const count = TOGETHER * Math.ceil(points.length / TOGETHER), moves = inputs === "xyzt";
    const h = new Float64Array((moves ? 4 : 3) * count);
    points.forEach((point, k) => point.forEach((c, axis) => h[axis * count + k] = c));
    if (moves) h.fill(time, 3 * count);
    return networkValues(network, h, count);
}

/** Returns [value, level] of the nested field (field/interpret.py) at a point [x, y, z] and time 0.
 * @param {Model} model @param {Vector} point */
export function fieldValue(model, point) {
    let value = 0, level = 0;
    do value += valuesAt(model, model.levels[level++].network, [point], 0)[0]; while (
        level < model.levels.length && Math.abs(value) < model.levels[level - 1].delta
    );
    return [value, level];
}

/** Returns the nested field of the first `depth` levels at points [x, y, z] and a time, with bands widened by
 * `margin`.
 * @param {Model} model @param {Vector[]} points @param {number} time @param {number} margin */
export function widenedValues(model, points, time, margin, depth = model.levels.length) {
    const values = new Float64Array(points.length);
    let inside = points.map((_, k) => k);
    for (const {network, delta} of model.levels.slice(0, depth)) {
        const added = valuesAt(model, network, inside.map((k) => points[k]), time);
        inside.forEach((k, i) => values[k] += added[i]);
        inside = inside.filter((k) => Math.abs(values[k]) < delta + margin);
        if (!inside.length) break;
    }
    return values;
}

/** Returns up to `count` probes, at time 0. The search walks inwards from the unit sphere.
 * @param {Model} model @returns {Probes} */
export function probes(model, count = 16) {
    const points = [], values = [];
    for (let k = 0; k < 2 * count && values.length < count; ++k) {
        const y = 1 - (2 * k + 1) / (2 * count), angle = 2.399963 * k, ring = Math.sqrt(1 - y * y);
        const direction = [ring * Math.cos(angle), y, ring * Math.sin(angle)];
        for (let r = 1, step = 0; step < 24 && r > 0 && r <= 1; ++step) {
            const point = direction.map((c) => Math.fround(c * r));
            const [value, level] = fieldValue(model, point);
            if (level === model.levels.length && Math.abs(value) < 0.02) {
                points.push(...point);
                values.push(value);
                break;
            }
            r -= 0.7 * value;
        }
    }
    return {points, values};
}
