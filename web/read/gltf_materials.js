import {encoded} from "./surface_colors.js";
/** @import {GltfFile} from "./gltf_data.js" */

// The colors of glTF 2.0 materials.

/** Returns the factor of the color (sRGB), the image, the number of its texture coordinates, and a function from these
 * to u and v, v upwards. @param {GltfFile} file @param {number} index */
export function materialOf({gltf, dataOf}, index) {
    const {pbrMetallicRoughness: metallic = {}, extensions} = gltf.materials?.[index] ?? {};
    const glossy = extensions?.KHR_materials_pbrSpecularGlossiness;
    const factor = glossy ? glossy.diffuseFactor : metallic.baseColorFactor;
    const info = glossy ? glossy.diffuseTexture : metallic.baseColorTexture;
    const texture = info && gltf.textures?.[info.index], more = texture?.extensions ?? {};
    const source = texture?.source ?? more.EXT_texture_webp?.source ?? more.KHR_texture_basisu?.source;
    const {name, uri, ...place} = gltf.images?.[/** @type {number} */ (source)] ?? {},
        moved = info?.extensions?.KHR_texture_transform ?? {};
    const {offset: [x, y] = [0, 0], rotation = 0, scale: [a, b] = [1, 1]} = moved;
    const cos = Math.cos(rotation), sin = Math.sin(rotation), isInside = String(uri ?? "data:").startsWith("data:");
    const label = isInside ? `${name ?? "texture"} (${source})` : String(uri); // names of images need not differ
    return {
        color: factor ? factor.slice(0, 3).map(encoded) : null,
        image: texture ? {name: label, bytes: dataOf({uri, ...place})} : null,
        coordinates: Number(moved.texCoord ?? info?.texCoord ?? 0),
        transform: (
            /** @type {number} */ u,
            /** @type {number} */ v,
        ) => [x + a * cos * u + b * sin * v, 1 - (y - a * sin * u + b * cos * v)],
    };
}
