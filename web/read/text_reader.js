import {decoded} from "./mesh_parts.js";

const TAB = 9, NEWLINE = 10, RETURN = 13, SPACE = 32, HASH = 35, PLUS = 43, MINUS = 45, POINT = 46, ZERO = 48, E = 101;
const BACKSLASH = 92;
const MOST = 1e300, POWERS = Float64Array.from({length: 309}, (_, i) => Number(`1e${i}`));
const LONGEST_NUMBER = 1000;

/** Reads words and numbers of a text file from its bytes, line by line, which is faster than strings and regular
 * expressions. A backslash at the end of a line joins the next line to it; # begins a comment. */
export class TextReader {
    /** @param {Uint8Array} bytes @param {number} start place of the first line */
    constructor(bytes, start = 0) {
        const isMarked = !start && bytes[0] === 0xef && bytes[1] === 0xbb && bytes[2] === 0xbf; // byte order mark
        this.bytes = bytes;
        this.at = isMarked ? 3 : start;
        this.line = 0;
    }

    // Goes to the next line, at first to the first one. Returns false at the end.
    nextLine() {
        const {bytes} = this;
        if (this.line++) {
            while (this.at < bytes.length && bytes[this.at] !== NEWLINE && bytes[this.at] !== RETURN) ++this.at;
            this.at += bytes[this.at] === RETURN && bytes[this.at + 1] === NEWLINE ? 2 : 1;
        }
        return this.at < bytes.length;
    }

    // Goes to the next word of the line. Returns its first byte; 0 at the line's end.
    peek() {
        const {bytes} = this;
        for (;;) {
            const byte = bytes[this.at];
            if (byte === SPACE || byte === TAB) {
                ++this.at;
            } else if (byte === BACKSLASH && (bytes[this.at + 1] === NEWLINE || bytes[this.at + 1] === RETURN)) {
                this.at += bytes[this.at + 1] === RETURN && bytes[this.at + 2] === NEWLINE ? 3 : 2;
                ++this.line;
            } else {
                return byte > SPACE && byte !== HASH ? byte : 0;
            }
        }
    }

    // Returns the next word of the line; an empty text at its end.
    word() {
        this.peek();
        const start = this.at;
        while (this.bytes[this.at] > SPACE) ++this.at;
        return decoded(this.bytes.subarray(start, this.at));
    }

    // Returns what is left of the line.
    rest() {
        this.peek();
        const start = this.at;
        while (this.bytes[this.at] >= SPACE || this.bytes[this.at] === TAB) ++this.at;
        return decoded(this.bytes.subarray(start, this.at)).trim();
    }

    // Returns the next word of the line as a number; NaN where it is none. One of over 15 digits may be off by a few
    // parts in 1e16.
    number() {
        this.peek();
        const {bytes} = this, start = this.at;
        let at = start, mantissa = 0, digits = 0, power = 0, byte = bytes[at];
        if (byte === MINUS || byte === PLUS) byte = bytes[++at];
        for (; byte >= ZERO && byte < ZERO + 10; byte = bytes[++at], ++digits) {
            mantissa = 10 * mantissa + byte - ZERO;
        }
        if (byte === POINT) {
            byte = bytes[++at];
            for (; byte >= ZERO && byte < ZERO + 10; byte = bytes[++at], ++digits, --power) {
                mantissa = 10 * mantissa + byte - ZERO;
            }
        }
        if (digits && (byte | 32) === E) {
            const isSmall = bytes[++at] === MINUS;
            const first = at += isSmall || bytes[at] === PLUS ? 1 : 0;
            let exponent = 0;
            for (byte = bytes[at]; byte >= ZERO && byte < ZERO + 10; byte = bytes[++at]) {
                exponent = Math.min(10 * exponent + byte - ZERO, 10000);
            }
            digits = at > first ? digits : 0;
            power += isSmall ? -exponent : exponent;
        }
        this.at = at;
        if (!digits || byte > SPACE || mantissa > MOST || power < -308 || power > 308) return this.slowNumber(start);
        const size = power < 0 ? mantissa / POWERS[-power] : mantissa * POWERS[power];
        return bytes[start] === MINUS ? -size : size;
    }

    /** @param {number} start */
    slowNumber(start) {
        this.at = start;
        while (this.bytes[this.at] > SPACE) ++this.at;
        const length = this.at - start;
        if (!length || length > LONGEST_NUMBER) return NaN;
        return Number(String.fromCharCode(...this.bytes.subarray(start, this.at)));
    }

    // Returns the integer that comes next, which anything may follow; NaN where there is none.
    integer() {
        const {bytes} = this, isNegative = bytes[this.at] === MINUS, start = this.at += isNegative ? 1 : 0;
        let value = 0;
        for (let byte = bytes[start]; byte >= ZERO && byte < ZERO + 10; byte = bytes[++this.at]) {
            value = 10 * value + byte - ZERO;
        }
        return this.at === start ? NaN : isNegative ? -value : value;
    }

    // Returns the next number of this line or of the lines after it. Throws RangeError at the end and at other words.
    next() {
        if (!this.line) this.nextLine();
        while (!this.peek()) if (!this.nextLine()) throw new RangeError("the text ends");
        const start = this.at, value = this.number();
        if (Number.isNaN(value) && (this.bytes[start + 1] | 32) !== 97 && (this.bytes[start + 2] | 32) !== 97) {
            throw new RangeError("no number"); // nan and -nan are numbers
        }
        return value;
    }
}
