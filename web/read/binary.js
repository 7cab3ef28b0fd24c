/** Bytes of numbers in binary files, by their types.
 * @typedef {keyof typeof SIZES} NumberType */
export const SIZES = {int8: 1, uint8: 1, int16: 2, uint16: 2, int32: 4, uint32: 4, float32: 4, float64: 8};

/** Returns a number of a DataView. Throws RangeError beyond its end.
 * @param {DataView} view @param {NumberType} type @param {number} at @param {boolean} isLittle */
export function numberAt(view, type, at, isLittle) {
    switch (type) {
        case "int8":
            return view.getInt8(at);
        case "uint8":
            return view.getUint8(at);
        case "int16":
            return view.getInt16(at, isLittle);
        case "uint16":
            return view.getUint16(at, isLittle);
        case "int32":
            return view.getInt32(at, isLittle);
        case "uint32":
            return view.getUint32(at, isLittle);
        case "float32":
            return view.getFloat32(at, isLittle);
        default:
            return view.getFloat64(at, isLittle);
    }
}

/** Returns a DataView of bytes. @param {Uint8Array} bytes */
export function viewOf(bytes) {
    return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
}
