// What a file is that the page does not open, by its first bytes as Latin-1.
/** @type {Record<string, RegExp>} */ const FIRST_BYTES = {
    "a JPEG picture": /^\xff\xd8/,
    "a PNG picture": /^.PNG/,
    "a GIF picture": /^GIF8/,
    "a WebP picture": /WEBP/,
    "a PDF document": /^%PDF/,
    "a ZIP archive": /^PK/,
};

/** Returns the kind with its article; undefined for another file. bytes: an ArrayBuffer. @param {ArrayBuffer} bytes */
export function kindOfFile(bytes) {
    const start = new TextDecoder("latin1").decode(bytes.slice(0, 12));
    return Object.keys(FIRST_BYTES).find((kind) => FIRST_BYTES[kind].test(start));
}
