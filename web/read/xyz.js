import {demand, demandFew, Growing, unitColors} from "./mesh_parts.js";
import {chosenProperties, GROUPS} from "./ply_header.js";
import {TextReader} from "./text_reader.js";

// Reads a cloud of text columns: x y z, and normals and colors in any order, by a header or by their numbers.
const COMMA = 44, SEMICOLON = 59, UNIT = 0.05; // largest error of a unit vector's length

/** @param {Uint8Array} bytes */
export function parseXyz(bytes) {
    const {table, width, header} = rowsOf(bytes), count = table.length / width, notes = [];
    const columns = (header && namedColumns(header, width)) ?? guessedColumns(table, width);
    /** @template {Float64Array | Float32Array} T
     * @param {T} taken @param {number[]} group columns */
    const take = (taken, group) => {
        group.forEach((column, k) => {
            for (let i = 0; i < count; ++i) taken[3 * i + k] = table[width * i + column];
        });
        return taken;
    };
    const {vertices, normals, tints} = columns, others = width - 3 * Object.values(columns).filter(Boolean).length;
    if (others) notes.push(`${others} of ${width} columns are not used`);
    return {
        vertices: take(new Float64Array(3 * count), vertices),
        normals: normals ? take(new Float64Array(3 * count), normals) : null,
        tints: tints ? unitColors(take(new Float32Array(3 * count), tints)) : null,
        faces: new Uint32Array(0),
        notes,
    };
}

/** Returns {table, width, header}: the numbers of rows of `width` columns, and the words of the line before the rows.
 * Lines before them that have fewer than three numbers, such as a count, are left out. @param {Uint8Array} bytes */
function rowsOf(bytes) {
    const text = new TextReader(bytes.map((byte) => (byte === COMMA || byte === SEMICOLON ? 32 : byte)));
    const table = new Growing(Float64Array);
    let width = 0, header = null;
    while (text.nextLine()) {
        const start = text.at, before = table.size;
        while (text.peek()) table.push(text.number());
        const found = table.size - before;
        if (!width && (found < 3 || Number.isNaN(table.array[before]))) {
            text.at = start;
            if (found > 2) header = text.rest().toLowerCase().replaceAll('"', "").split(/\s+/);
            table.size = before;
        } else if (found) {
            width ||= found;
            demandFew(table.size / width, "points");
            demand(found === width, `line ${text.line}: ${found} columns, where the lines before have ${width}`);
        }
    }
    demand(width, "no rows of three numbers");
    return {table: table.filled, width, header};
}

/** @param {string[]} header @param {number} width */
function namedColumns(header, width) {
    const columns = header.slice(0, width).map((name, column) => ({name, column}));
    const found = (/** @type {string[]} */ group) => chosenProperties(columns, group)?.map(({column}) => column);
    const vertices = found(GROUPS.vertices);
    return vertices && {vertices, normals: found(GROUPS.normals), tints: found(GROUPS.tints)};
}

/** Normals are three columns of unit vectors, or else with negative numbers; three other columns from 0 on are colors.
 * @param {Float64Array} table @param {number} width */
function guessedColumns(table, width) {
    const firsts = Array.from({length: Math.max(0, width - 5)}, (_, i) => i + 3);
    /** @param {number} first @param {(x: number, y: number, z: number, length: number) => boolean} test */
    const everyRow = (first, test) => {
        for (let at = first; at < table.length; at += width) {
            const length = Math.hypot(table[at], table[at + 1], table[at + 2]);
            if (length > 0 && !test(table[at], table[at + 1], table[at + 2], length)) return false;
        }
        return true;
    };
    const isUnit = (/** @type {number} */ first) =>
        everyRow(first, (_x, _y, _z, length) => Math.abs(length - 1) < UNIT);
    const isPositive = (/** @type {number} */ first) => everyRow(first, (x, y, z) => Math.min(x, y, z) >= 0);
    const grouped = firsts.filter((first) => first % 3 === 0 && width % 3 === 0);
    const normals = firsts.find((first) => isUnit(first) && !isPositive(first))
        ?? grouped.find((first) => !isPositive(first));
    const free = firsts.filter((first) => normals === undefined || Math.abs(first - normals) > 2);
    const tints = free.length === 1 && isPositive(free[0]) ? free[0] : undefined;
    const three = (/** @type {number | undefined} */ first) =>
        first === undefined ? null : [first, first + 1, first + 2];
    return {vertices: [0, 1, 2], normals: three(normals), tints: three(tints)};
}
