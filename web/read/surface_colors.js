/** @import {Picture, ShapeColors} from "./mesh_file.js" */

// Colors of a surface, from vertices, materials and images.

/** Returns the sRGB of linear light, both in [0, 1]. @param {number} c */
export function encoded(c) {
    if (!(c > 0.0031308)) return c > 0 ? 12.92 * c : 0;
    return c < 1 ? 1.055 * c ** (1 / 2.4) - 0.055 : 1;
}

/** The inverse of encoded(). @param {number} c */
export function linear(c) {
    return c > 0.04045 ? ((c + 0.055) / 1.055) ** 2.4 : c / 12.92;
}

// Looks up colors of a shape's faces.
export class SurfaceColors {
    /** @param {ShapeColors} colors @param {Uint32Array} faces (3 F) */
    constructor({vertex, uv, material, materials}, faces) {
        this.vertex = vertex;
        this.uv = uv;
        this.material = material;
        this.materials = materials;
        this.faces = faces;
        this.texel = new Float64Array(3);
    }

    /** Writes the sRGB color, three numbers in [0, 1], of the point a + s (b - a) + t (c - a) of a face to an array.
     * Colors of vertices, the material and its image multiply as linear light.
     * @param {number} face @param {number} s @param {number} t @param {Float32Array} to @param {number} at */
    write(face, s, t, to, at) {
        const {vertex, uv, faces, texel} = this, material = this.materials[this.material?.[face] ?? 0];
        const [a, b, c] = [3 * faces[3 * face], 3 * faces[3 * face + 1], 3 * faces[3 * face + 2]], r = 1 - s - t;
        if (uv && material?.image) {
            const i = 6 * face;
            const u = r * uv[i] + s * uv[i + 2] + t * uv[i + 4], v = r * uv[i + 1] + s * uv[i + 3] + t * uv[i + 5];
            sample(material.image, u, v, texel);
        } else {
            texel.fill(1);
        }
        for (let k = 0; k < 3; ++k) {
            const own = vertex ? r * vertex[a + k] + s * vertex[b + k] + t * vertex[c + k] : 1;
            to[at + k] = inLight(inLight(texel[k], material?.color[k] ?? 1), own);
        }
    }
}

/** @param {number} one @param {number} other */
function inLight(one, other) {
    return one === 1 ? other : other === 1 ? one : encoded(linear(one) * linear(other));
}

/** Writes the color of an image at u, v (upwards) to three numbers: bilinear, repeating, as OpenGL does.
 * @param {Picture} image @param {number} u @param {number} v @param {Float64Array} to */
function sample({width, height, pixels}, u, v, to) {
    const x = u * width - 0.5, y = (1 - v) * height - 0.5, left = Math.floor(x), top = Math.floor(y);
    const across = x - left, down = y - top;
    const x0 = wrapped(left, width), x1 = wrapped(left + 1, width);
    const y0 = width * wrapped(top, height), y1 = width * wrapped(top + 1, height);
    for (let k = 0; k < 3; ++k) {
        const upper = pixels[4 * (y0 + x0) + k] * (1 - across) + pixels[4 * (y0 + x1) + k] * across;
        const lower = pixels[4 * (y1 + x0) + k] * (1 - across) + pixels[4 * (y1 + x1) + k] * across;
        to[k] = (upper * (1 - down) + lower * down) / 255;
    }
}

/** @param {number} place @param {number} size */
function wrapped(place, size) {
    return ((place % size) + size) % size;
}
