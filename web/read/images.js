import {viewOf} from "./binary.js";
import {demand} from "./mesh_parts.js";

// Decodes images of textures.
const MOST_DECODED = 100e6, MOST_SIDE = 2048; // pixels
const MOST_PIXELS = 2 ** 23; // of all images together, after they are made smaller

/** Decodes a PNG, JPEG or WebP, smaller where it is large. Throws MeshError.
 * @param {Uint8Array} bytes @param {number} count of images that the shape has */
export async function decodeImage(bytes, count) {
    const [wide, high] = imageSize(bytes) ?? [];
    demand(wide, "is not a PNG, JPEG or WebP");
    demand(wide * high <= MOST_DECODED, `has ${wide} x ${high} pixels; the limit is ${MOST_DECODED / 1e6} million`);
    let bitmap;
    try {
        bitmap = await createImageBitmap(new Blob([/** @type {BlobPart} */ (bytes)]), {
            premultiplyAlpha: "none",
            colorSpaceConversion: "none",
        });
    } catch {
        demand(false, "is damaged");
    }
    const most = MOST_PIXELS / count, sides = [bitmap.width, bitmap.height];
    const scale = Math.min(1, MOST_SIDE / Math.max(...sides), Math.sqrt(most / (wide * high)));
    const [width, height] = sides.map((side) => Math.max(1, Math.floor(scale * side)));
    const context = /** @type {OffscreenCanvasRenderingContext2D} */ (
        new OffscreenCanvas(width, height).getContext("2d", {willReadFrequently: true})
    );
    context.imageSmoothingQuality = "high";
    context.drawImage(bitmap, 0, 0, width, height);
    bitmap.close();
    return {width, height, pixels: context.getImageData(0, 0, width, height).data};
}

/** Returns the width and height that an image's header states, before anything is decoded; null for other formats.
 * @param {Uint8Array} bytes */
function imageSize(bytes) {
    const view = viewOf(bytes), size = bytes.length;
    if (size >= 24 && view.getUint32(0) === 0x89504e47) return [view.getUint32(16), view.getUint32(20)];
    if (size >= 31 && view.getUint32(0) === 0x52494646 && view.getUint32(8) === 0x57454250) { // RIFF, WEBP
        const kind = bytes[15], low = (/** @type {number} */ at) => view.getUint16(at, true) & 0x3fff;
        if (kind === 0x58) return [24, 27].map((at) => 1 + (view.getUint32(at, true) & 0xffffff)); // VP8X
        if (kind === 0x4c) return [1 + low(21), 1 + (view.getUint32(21, true) >>> 14 & 0x3fff)]; // VP8L
        return [low(26), low(28)];
    }
    if (size < 4 || view.getUint16(0) !== 0xffd8) return null;
    for (let at = 2; at + 9 < size && bytes[at] === 0xff;) { // the segments of a JPEG
        const marker = bytes[at + 1];
        const isFrame = marker >= 0xc0 && marker <= 0xcf && ![0xc4, 0xc8, 0xcc].includes(marker);
        if (isFrame) return [view.getUint16(at + 7), view.getUint16(at + 5)];
        at += marker === 0xff ? 1 : 2 + view.getUint16(at + 2);
    }
    return null;
}
