// Finds points at one place.

/** Returns for each row of `width` numbers the index of the first row that equals it, a Uint32Array. Makes -0 to 0.
 * @param {Float64Array} numbers */
export function firstEqual(numbers, width = 3) {
    const count = numbers.length / width, first = new Uint32Array(count);
    for (let i = 0; i < numbers.length; ++i) numbers[i] += 0;
    const bits = new Uint32Array(numbers.buffer, numbers.byteOffset, 2 * numbers.length);
    const mask = 2 ** Math.ceil(Math.log2(2 * count + 2)) - 1, slots = new Uint32Array(mask + 1); // row + 1, or 0
    const seed = Math.random() * 2 ** 32; // so that no file can make all rows fall into one slot
    for (let i = 0; i < count; ++i) {
        let slot = seed;
        for (let k = 2 * width * i; k < 2 * width * (i + 1); ++k) {
            slot = Math.imul(slot ^ bits[k], 0x9e3779b1);
            slot ^= slot >>> 15;
        }
        for (slot &= mask; slots[slot]; slot = (slot + 1) & mask) {
            const at = width * (slots[slot] - 1);
            let k = 0;
            while (k < width && numbers[at + k] === numbers[width * i + k]) ++k;
            if (k === width) break;
        }
        if (!slots[slot]) slots[slot] = i + 1;
        first[i] = slots[slot] - 1;
    }
    return first;
}
