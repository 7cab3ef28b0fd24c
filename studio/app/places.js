// Finds points at one place.

// Returns for each row of three numbers the index of the first row that equals it, a Uint32Array. Afterwards, -0 is 0.
export function firstEqual(numbers) {
    const count = numbers.length / 3, first = new Uint32Array(count);
    for (let i = 0; i < numbers.length; ++i) numbers[i] += 0;
    const bits = new Uint32Array(numbers.buffer, numbers.byteOffset, 2 * numbers.length);
    const mask = 2 ** Math.ceil(Math.log2(2 * count + 2)) - 1, slots = new Uint32Array(mask + 1); // row + 1, or 0
    const seed = Math.random() * 2 ** 32; // so that no file can make all rows fall into one slot
    for (let i = 0; i < count; ++i) {
        let slot = seed;
        for (let k = 0; k < 6; ++k) {
            slot = Math.imul(slot ^ bits[6 * i + k], 0x9e3779b1);
            slot ^= slot >>> 15;
        }
        for (slot &= mask; slots[slot]; slot = (slot + 1) & mask) {
            const at = 3 * (slots[slot] - 1), x = numbers[3 * i], y = numbers[3 * i + 1], z = numbers[3 * i + 2];
            if (numbers[at] === x && numbers[at + 1] === y && numbers[at + 2] === z) break;
        }
        if (!slots[slot]) slots[slot] = i + 1;
        first[i] = slots[slot] - 1;
    }
    return first;
}
