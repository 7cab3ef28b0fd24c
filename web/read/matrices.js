/** A column-major matrix of 4 x 4 numbers. @typedef {number[] | Float64Array} Matrix */
export const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

/** @param {Matrix} a @param {Matrix} b */
export function matrixProduct(a, b) {
    return IDENTITY.map((_, i) => [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * k + i % 4] * b[4 * (i >> 2) + k], 0));
}

/** Returns the matrix of a glTF node.
 * @param {{translation?: Iterable<number>, rotation?: Iterable<number>, scale?: Iterable<number>}} node rotation: a
 *     quaternion */
export function matrixOf({translation: t = [0, 0, 0], rotation = [0, 0, 0, 1], scale: [a, b, c] = [1, 1, 1]}) {
    const [x, y, z, w] = rotation;
    return [
        a * (1 - 2 * (y * y + z * z)),
        2 * a * (x * y + z * w),
        2 * a * (x * z - y * w),
        0,
        2 * b * (x * y - z * w),
        b * (1 - 2 * (x * x + z * z)),
        2 * b * (y * z + x * w),
        0,
        2 * c * (x * z + y * w),
        2 * c * (y * z - x * w),
        c * (1 - 2 * (x * x + y * y)),
        0,
        ...t,
        1,
    ];
}

/** Whether a matrix turns triangles inside out. @param {Matrix} m */
export function isMirror(m) {
    const [x, y, z] = normalMatrix(m);
    return m[0] * x + m[1] * y + m[2] * z < 0;
}

/** Returns the matrix of 3 x 3 numbers that turns normals: the inverse transpose, times the determinant.
 * @param {Matrix} matrix */
export function normalMatrix([a, b, c, , d, e, f, , g, h, i]) {
    return [
        e * i - f * h,
        f * g - d * i,
        d * h - e * g,
        h * c - i * b,
        i * a - g * c,
        g * b - h * a,
        b * f - c * e,
        c * d - a * f,
        a * e - b * d,
    ];
}
