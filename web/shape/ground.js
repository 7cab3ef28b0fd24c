import {turned} from "../model/orientation.js";
/** @import {FacetedShape} from "./load_shape.js" */

/** Returns the height of the lowest point of a shape that stands upright, model space.
 * @param {{read: FacetedShape, up: Up}} shape up: axis of its file */
export function groundOf({read: {vertices, facets}, up}) {
    const upright = turned((facets ?? {vertices}).vertices, up);
    let y = Infinity;
    for (let i = 1; i < upright.length; i += 3) y = Math.min(y, upright[i]);
    return y;
}
