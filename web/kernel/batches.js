import {SAMPLE} from "./kernel.js";

/** Draws batches of a pool without replacement: each sample once in an epoch, in a new order each time. */
export class Batches {
    /** @param {Float32Array} rows of samples @param {() => number} random returns numbers in [0, 1) */
    constructor(rows, random) {
        this.rows = rows;
        this.order = Uint32Array.from({length: rows.length / SAMPLE}, (_, i) => i);
        this.random = random;
        this.next = this.order.length;
    }

    /** Copies `count` samples to an array, from its `start`-th sample on.
     * @param {number} count @param {Float32Array} to @param {number} start */
    draw(count, to, start) {
        for (let i = 0; i < count; ++i) {
            if (this.next === this.order.length) this.shuffle();
            const from = SAMPLE * this.order[this.next++];
            for (let k = 0; k < SAMPLE; ++k) to[SAMPLE * (start + i) + k] = this.rows[from + k];
        }
    }

    shuffle() {
        const {order} = this;
        for (let i = order.length - 1; i > 0; --i) {
            const j = Math.floor(this.random() * (i + 1)), other = order[j];
            order[j] = order[i];
            order[i] = other;
        }
        this.next = 0;
    }
}
