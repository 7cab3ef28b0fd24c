// What a file is that the page does not open, by its first bytes as Latin-1.
const FIRST_BYTES = {
    "an empty file": /^$/, "a JPEG picture": /^\xff\xd8\xff/, "a PNG picture": /^\x89PNG/, "a GIF picture": /^GIF8/,
    "a WebP picture": /^RIFF....WEBP/s, "a video": /^....ftyp/s, "a PDF document": /^%PDF/, "a ZIP archive": /^PK\x03\x04/,
    "a Blender file": /^BLENDER/, "an FBX file": /^Kaydara FBX/, "a STEP file": /^ISO-10303/, "a web page": /^<(!doctype )?html/i,
};

// Returns the kind with its article; undefined for another file. bytes: an ArrayBuffer.
export function kindOfFile(bytes) {
    const start = String.fromCharCode(...new Uint8Array(bytes, 0, Math.min(bytes.byteLength, 16)));
    return Object.keys(FIRST_BYTES).find((kind) => FIRST_BYTES[kind].test(start));
}
