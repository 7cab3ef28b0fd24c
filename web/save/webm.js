// Writes encoded frames as a WebM file (Matroska, RFC 9559). Its elements are named by their IDs.

/** An encoded frame. time: in milliseconds. @typedef {{data: Uint8Array, time: number, isKey: boolean}} Block */

/** Returns a Blob. @param {Block[]} blocks the first is a key frame
 * @param {{name: string, width: number, height: number, duration: number}} video name: of the codec; duration: in
 *     milliseconds */
export function webm(blocks, {name, width, height, duration}) {
    /** @type {Block[][]} */
    const clusters = []; // each begins with a key frame
    for (const block of blocks) {
        if (block.isKey) clusters.push([block]);
        else clusters.at(-1)?.push(block);
    }
    const info = ebml("1549a966", [
        ebml("2ad7b1", whole(1e6)), // nanoseconds of a unit of time
        ebml("4489", real(duration)),
        ebml("4d80", letters("mplicits")),
        ebml("5741", letters("mplicits")),
    ]);
    const tracks = ebml(
        "1654ae6b",
        ebml("ae", [
            ebml("d7", whole(1)),
            ebml("73c5", whole(1)),
            ebml("83", whole(1)),
            ebml("86", letters(name)),
            ebml("e0", [ebml("b0", whole(width)), ebml("ba", whole(height))]),
        ]),
    );
    const packed = clusters.map((group) =>
        ebml("1f43b675", [
            ebml("e7", whole(group[0].time)),
            group.map((block) => simpleBlock(block, group[0].time)),
        ])
    );
    // Places of the clusters, counted from the first element of the segment.
    const cues = (/** @type {number} */ first) => {
        let at = first;
        return ebml(
            "1c53bb6b",
            clusters.map((group, i) => {
                const place = ebml("b7", [ebml("f7", whole(1)), ebml("f1", whole(at))]);
                at += sizeOf(packed[i]);
                return ebml("bb", [ebml("b3", whole(group[0].time)), place]);
            }),
        );
    };
    const before = sizeOf([info, tracks, cues(0)]);
    const head = ebml("1a45dfa3", [
        ebml("4286", whole(1)),
        ebml("42f7", whole(1)),
        ebml("42f2", whole(4)),
        ebml("42f3", whole(8)),
        ebml("4282", letters("webm")),
        ebml("4287", whole(4)),
        ebml("4285", whole(2)),
    ]);
    const file = /** @type {unknown[]} */ ([head, ebml("18538067", [info, tracks, cues(before), packed])]);
    return new Blob(/** @type {BlobPart[]} */ (file.flat(Infinity)), {type: "video/webm"});
}

/** @param {Block} block @param {number} start */
function simpleBlock({data, time, isKey}, start) {
    const head = new Uint8Array(4);
    new DataView(head.buffer).setInt16(1, time - start);
    head[0] = 0x81; // of track 1
    head[3] = isKey ? 0x80 : 0;
    return ebml("a3", [head, data]);
}

/** Returns an element. Sizes and whole numbers take eight bytes each.
 * @param {string} id @param {NestedBytes} content @returns {NestedBytes} */
function ebml(id, content) {
    const size = whole(sizeOf(content));
    size[0] = 1;
    return [Uint8Array.from(id.match(/../g) ?? [], (byte) => Number.parseInt(byte, 16)), size, content];
}

/** @param {NestedBytes} content @returns {number} */
function sizeOf(content) {
    return content instanceof Uint8Array ? content.length : content.reduce((sum, part) => sum + sizeOf(part), 0);
}

/** @param {number} number */
function whole(number) {
    const bytes = new Uint8Array(8);
    new DataView(bytes.buffer).setBigUint64(0, BigInt(number));
    return bytes;
}

/** @param {number} number */
function real(number) {
    const bytes = new Uint8Array(8);
    new DataView(bytes.buffer).setFloat64(0, number);
    return bytes;
}

/** @param {string} text */
function letters(text) {
    return new TextEncoder().encode(text);
}
