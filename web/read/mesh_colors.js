import {decodeImage} from "./images.js";
import {MeshError, shownName} from "./mesh_parts.js";
/** @import {FoundMaterial, InputFile, Parsed, Picture, ShapeColors} from "./mesh_file.js" */

// The colors of a shape, from what its reader found and from the images beside it.
const IMAGE = /\.(png|jpe?g|webp)$/i, GRAY = [0.8, 0.8, 0.8]; // of materials without a color

/** Returns the colors of a shape; null where it is of one gray.
 * @param {Parsed} parsed @param {InputFile[]} files @param {string[]} notes gets lines about what is missing
 * @returns {Promise<ShapeColors | null>} */
export async function colorsOf({faces, tints, uv = null, material = null, materials = [], isProduct}, files, notes) {
    const bare = () => materials.map((entry) => ({...entry, image: null}));
    const drawn = uv ? withSpareImage(materials, files, notes) : bare();
    const images = await decodedImages(drawn, notes), hasImage = [...images.values()].some(Boolean);
    const vertex = tints && (isProduct || !hasImage) && !isOneGray(tints) ? tints : null;
    if (vertex && !isProduct) return {vertex, uv: null, material: null, materials: []};
    const plain = isProduct && vertex ? [1, 1, 1] : GRAY;
    const found = drawn.map(({color, image}) => {
        const decoded = (image && images.get(image.name)) ?? null, own = decoded && !isProduct ? null : color;
        return {color: own ?? (decoded ? [1, 1, 1] : plain), image: decoded};
    });
    const used = material && found.length > 1 ? material.map((index) => (index < found.length ? index : 0)) : null;
    const seen = new Set(used ?? [0]), colors = found.filter((_, index) => seen.has(index)).flatMap(({color}) => color);
    if (!vertex && !hasImage && (!faces.length || isOneGray(colors))) {
        if (uv && !images.size) notes.push("texture coordinates, but no image; drop it together with the mesh");
        return null;
    }
    const finite = hasImage && uv ? uv.map((c) => (Number.isFinite(c) ? c : 0)) : null;
    return {vertex, uv: finite, material: used, materials: found};
}

/** Gives the only image that was dropped to materials, if none of their own is there.
 * @param {FoundMaterial[]} materials @param {InputFile[]} files @param {string[]} notes @returns {FoundMaterial[]} */
function withSpareImage(materials, files, notes) {
    const spare = files.filter(({name}) => IMAGE.test(name));
    if (spare.length !== 1 || materials.some(({image}) => image?.bytes)) return materials;
    const [{name, bytes}] = spare, image = {name, bytes: new Uint8Array(bytes)};
    notes.push(`the texture is ${shownName(name)}, which the mesh does not name`);
    const isNamed = materials.some((entry) => entry.image);
    const own = materials.length ? materials : [{color: null, image: null}];
    return own.map((entry) => ({...entry, image: entry.image || !isNamed ? image : null}));
}

/** Returns the name of each image -> the decoded image, or null.
 * @param {FoundMaterial[]} materials @param {string[]} notes @returns {Promise<Map<string, Picture | null>>} */
async function decodedImages(materials, notes) {
    const decoded = new Map(), named = new Map();
    for (const {color, image} of materials) if (image) named.set(image.name, {color, ...image});
    for (const [name, {bytes, color}] of named) {
        let problem = "is missing";
        decoded.set(name, null);
        try {
            if (bytes) decoded.set(name, await decodeImage(bytes, named.size));
        } catch (error) {
            if (!(error instanceof MeshError)) throw error;
            problem = error.message;
        }
        const instead = color ? "the material's color" : "gray";
        if (!decoded.get(name)) notes.push(`the image ${shownName(name)} ${problem}; ${instead} instead`);
    }
    return decoded;
}

/** @param {ArrayLike<number>} colors */
function isOneGray(colors) {
    for (let i = 0; i < colors.length; ++i) if (colors[i] !== colors[0]) return false;
    return true;
}
