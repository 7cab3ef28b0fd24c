// Evaluates the field in double precision on the CPU. The shader of a model that was dropped is compared with this.
function networkValue(network, point) {
    let h = point;
    network.forEach(({rows, columns, weight, bias}, j) => {
        const next = new Float64Array(rows);
        for (let o = 0; o < rows; ++o) {
            let sum = bias[o];
            for (let i = 0; i < columns; ++i) sum += weight[o * columns + i] * h[i];
            next[o] = j < network.length - 1 ? Math.sin(sum) : sum;
        }
        h = next;
    });
    return h[0];
}

// Returns what the networks take at a point [x, y, z] and a time.
const inputOf = ({inputs}, point, time) => (inputs === "xyzt" ? [...point, time] : point);

// Returns the value of level 1 at a point [x, y, z] and a time.
export const firstValue = (model, point, time) => networkValue(model.levels[0].network, inputOf(model, point, time));

// Returns [value, level] of the finest level that is defined at a point [x, y, z] (Eq. 3), at time 0.
export function fieldValue(model, point) {
    const input = inputOf(model, point, 0);
    let value = 0, level = 0;
    do value += networkValue(model.levels[level++].network, input);
    while (level < model.levels.length && Math.abs(value) < model.levels[level - 1].delta);
    return [value, level];
}

// Returns the value of the finest level that is defined at a point [x, y, z] at a time, where each band is wider by
// `margin`.
export function widenedValue({levels, inputs}, point, time, margin) {
    const input = inputOf({inputs}, point, time);
    let value = 0;
    levels.every(({network, delta}) => {
        value += networkValue(network, input);
        return Math.abs(value) < delta + margin;
    });
    return value;
}

// Returns {points, values}: the coordinates, one after another, of up to `count` points near the surface, which are
// found by walking inwards from the unit sphere, and the field's value at each, at time 0.
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
