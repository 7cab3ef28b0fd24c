// Normals of triangles, and their means around vertices.

/** Returns the products (b - a) x (c - a) of faces (3 F): their normals times twice their areas.
 * @param {Float64Array} v vertices @param {Uint32Array} faces */
export function crossProducts(v, faces) {
    const products = new Float64Array(faces.length);
    for (let i = 0; i < faces.length; i += 3) {
        const a = 3 * faces[i], b = 3 * faces[i + 1], c = 3 * faces[i + 2];
        const ux = v[b] - v[a], uy = v[b + 1] - v[a + 1], uz = v[b + 2] - v[a + 2];
        const wx = v[c] - v[a], wy = v[c + 1] - v[a + 1], wz = v[c + 2] - v[a + 2];
        products[i] = uy * wz - uz * wy;
        products[i + 1] = uz * wx - ux * wz;
        products[i + 2] = ux * wy - uy * wx;
    }
    return products;
}

/** Scales vectors (3 N) to length one, in place; zero stays zero. @param {Float64Array} vectors */
export function toUnits(vectors) {
    for (let i = 0; i < vectors.length; i += 3) {
        const x = vectors[i], y = vectors[i + 1], z = vectors[i + 2], length = Math.sqrt(x * x + y * y + z * z) || 1;
        vectors[i] = x / length;
        vectors[i + 1] = y / length;
        vectors[i + 2] = z / length;
    }
    return vectors;
}

/** Returns the mean normals (3 N) of N groups of corners, weighted by the faces' angles; zero where they cancel.
 * @param {Float64Array} v vertices @param {Uint32Array} faces @param {Float64Array} products of crossProducts
 * @param {Uint32Array} group of each corner (3 F) @param {number} count */
export function meanNormals(v, faces, products, group, count) {
    const sums = new Float64Array(3 * count), angles = new Float64Array(3);
    for (let i = 0; i < faces.length; i += 3) {
        const a = 3 * faces[i], b = 3 * faces[i + 1], c = 3 * faces[i + 2];
        const x = products[i], y = products[i + 1], z = products[i + 2], area = Math.sqrt(x * x + y * y + z * z);
        if (!(area > 0)) continue;
        const ux = v[b] - v[a], uy = v[b + 1] - v[a + 1], uz = v[b + 2] - v[a + 2];
        const wx = v[c] - v[a], wy = v[c + 1] - v[a + 1], wz = v[c + 2] - v[a + 2];
        const uw = ux * wx + uy * wy + uz * wz;
        angles[0] = Math.atan2(area, uw);
        angles[1] = Math.atan2(area, ux * ux + uy * uy + uz * uz - uw);
        angles[2] = Math.PI - angles[0] - angles[1];
        for (let k = 0; k < 3; ++k) {
            const at = 3 * group[i + k], weight = angles[k] / area;
            sums[at] += weight * x;
            sums[at + 1] += weight * y;
            sums[at + 2] += weight * z;
        }
    }
    return toUnits(sums);
}
