// Shared by the readers of shapes. A MeshError has a one-line message.
const UTF8 = new TextDecoder("utf-8", {fatal: true}), LATIN1 = new TextDecoder("latin1");

export class MeshError extends Error {}

// Largest number of triangles, and of points, that the page trains with: its trees must fit in each worker's memory.
const MOST_PARTS = 2_000_000;

/** Throws a MeshError if there are too many triangles or points.
 * @param {number} count @param {string} kind their name */
export function demandFew(count, kind) {
    if (count <= MOST_PARTS) return; // words take time
    demand(false, `over ${MOST_PARTS.toLocaleString("en")} ${kind}; train it with: mplicits train`);
}

/** Throws a MeshError unless a condition holds.
 * @param {unknown} condition @param {string} message @returns {asserts condition} */
export function demand(condition, message) {
    if (!condition) throw new MeshError(message);
}

/** Returns a name as it may stand in a message: one short line. @param {unknown} name */
export function shownName(name) {
    return String(name).replace(/[\p{C}\p{Zl}\p{Zp}]/gu, "?").slice(0, 60);
}

/** An array of numbers to which one can add. They are doubles until the end, since code for several types of arrays
 * runs much slower. @template {Float64Array | Float32Array | Uint32Array | Int32Array | Uint16Array} T */
export class Growing {
    /** @param {new (numbers: Float64Array) => T} Type of the final array */
    constructor(Type) {
        this.Type = Type;
        this.array = new Float64Array(1024);
        this.size = 0;
    }

    /** @param {number} value */
    push(value) {
        if (this.size === this.array.length) this.reserve(1);
        this.array[this.size++] = value;
    }

    /** Makes room for `count` more numbers. @param {number} count */
    reserve(count) {
        if (this.size + count <= this.array.length) return;
        const larger = new Float64Array(Math.max(2 * this.size, this.size + count));
        larger.set(this.array);
        this.array = larger;
    }

    /** Adds a value until there are `size` numbers. @param {number} value @param {number} size */
    fill(value, size) {
        while (this.size < size) this.push(value);
    }

    get filled() {
        return new this.Type(this.array.subarray(0, this.size));
    }
}

/** Returns an array of a type with the numbers 0, 1, 2, ...
 * @template {Float64Array | Uint32Array} T @param {new (count: number) => T} Type @param {number} count */
export function firstNumbers(Type, count) {
    const numbers = new Type(count);
    for (let i = 0; i < count; ++i) numbers[i] = i;
    return numbers;
}

/** Returns colors within [0, 1], in place. Some programs write numbers up to 255 as floats.
 * @template {Float64Array | Float32Array} T @param {T} colors */
export function unitColors(colors) {
    const most = /** @type {Float64Array} */ (colors).reduce((largest, c) => Math.max(largest, c), 0),
        scale = most > 1 && most <= 255 ? 1 / 255 : 1;
    for (let i = 0; i < colors.length; ++i) colors[i] = colors[i] > 0 ? Math.min(1, scale * colors[i]) : 0;
    return colors;
}

/** Returns the texture coordinates (6 F) of the corners of triangles; null where no corner has a place.
 * @param {Float32Array} table pairs u, v
 * @param {Int32Array | Uint32Array} places of the corners in the table; -1 and missing places are (0, 0) */
export function cornerCoordinates(table, places) {
    const uv = new Float32Array(2 * places.length);
    let isUsed = false;
    places.forEach((place, i) => {
        if (!(2 * place + 1 < table.length) || place < 0) return;
        uv[2 * i] = table[2 * place];
        uv[2 * i + 1] = table[2 * place + 1];
        isUsed = true;
    });
    return isUsed ? uv : null;
}

/** Returns text of bytes: UTF-8, or else Latin 1. @param {Uint8Array} bytes */
export function decoded(bytes) {
    try {
        return UTF8.decode(bytes);
    } catch {
        return LATIN1.decode(bytes);
    }
}
