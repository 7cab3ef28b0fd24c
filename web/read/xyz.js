import {demand, demandFew, Growing, unitColors} from "./mesh_parts.js";
import {chosenProperties, GROUPS} from "./ply_header.js";
import {TextReader} from "./text_reader.js";

// Reads a cloud of text columns: x y z, and normals and colors in any order, by a header or by their numbers.
const COMMA = 44, SEMICOLON = 59, UNIT = 0.05; // largest error of a unit vector's length

// Returns what parsedShape (mesh_file.js) describes.
export function parseXyz(bytes) {
    const {table, width, header} = rowsOf(bytes), count = table.length / width, notes = [];
    const columns = (header && namedColumns(header, width)) ?? guessedColumns(table, width);
    const take = (group, Type) => {
        if (!columns[group]) return null;
        const taken = new Type(3 * count);
        columns[group].forEach((column, k) => {
            for (let i = 0; i < count; ++i) taken[3 * i + k] = table[width * i + column];
        });
        return taken;
    };
    const others = width - 3 * Object.values(columns).filter(Boolean).length, tints = take("tints", Float32Array);
    if (others) notes.push(`${others} of ${width} columns are not used`);
    return {
        vertices: take("vertices", Float64Array),
        normals: take("normals", Float64Array),
        tints: tints && unitColors(tints),
        faces: new Uint32Array(0),
        notes,
    };
}

// Returns {table, width, header}: the numbers of rows of `width` columns, and the words of the line before the rows.
// Lines before them that have fewer than three numbers, such as a count, are left out.
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

function namedColumns(header, width) {
    const columns = header.slice(0, width).map((name, column) => ({name, column}));
    const found = (group) => chosenProperties(columns, GROUPS[group])?.map(({column}) => column);
    return found("vertices") && {vertices: found("vertices"), normals: found("normals"), tints: found("tints")};
}

// Normals are three columns of unit vectors, or else with negative numbers; three other columns from 0 on are colors.
function guessedColumns(table, width) {
    const firsts = Array.from({length: Math.max(0, width - 5)}, (_, i) => i + 3);
    const everyRow = (first, test) => {
        for (let at = first; at < table.length; at += width) {
            const length = Math.hypot(table[at], table[at + 1], table[at + 2]);
            if (length > 0 && !test(table[at], table[at + 1], table[at + 2], length)) return false;
        }
        return true;
    };
    const isUnit = (first) => everyRow(first, (x, y, z, length) => Math.abs(length - 1) < UNIT);
    const isPositive = (first) => everyRow(first, (x, y, z) => Math.min(x, y, z) >= 0);
    const grouped = firsts.filter((first) => first % 3 === 0 && width % 3 === 0);
    const normals = firsts.find((first) => isUnit(first) && !isPositive(first))
        ?? grouped.find((first) => !isPositive(first));
    const free = firsts.filter((first) => normals === undefined || Math.abs(first - normals) > 2);
    const tints = free.length === 1 && isPositive(free[0]) ? free[0] : undefined;
    const three = (first) => (first === undefined ? null : [first, first + 1, first + 2]);
    return {vertices: [0, 1, 2], normals: three(normals), tints: three(tints)};
}
