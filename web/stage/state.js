/** @import {FacetedShape} from "../shape/load_shape.js" */
/** @import {Team} from "../train/workers.js" */
/** @import {LivePicture} from "./training_picture.js" */

/** A shape of a file: input space = model space * scale + center. front: as of Model.
 * @typedef {{name: string, center: Vector, scale: number, up: Up, front: number[] | null}} FileShape */
/** The shape on the stage. crease: of withFacets(); loading: resolves when its workers have it.
 * @typedef {FileShape & {read: FacetedShape, crease: number | null, team: Team,
 *     loading: Promise<WebAssembly.Module> | null}} StageShape */
/** A training under way. isLeft: for another file; isSeen: whether its field was drawn; paused: seconds.
 * @typedef {{isPaused: boolean, isStopped: boolean, isLeft?: boolean, isSeen?: boolean, paused: number,
 *     live: LivePicture}} Training */
/** The last training's result. bytes: of the model file; isFar: see judged().
 * @typedef {Trained & {settings: Settings, seconds: number, bytes: Uint8Array<ArrayBuffer>, isSaved: boolean,
 *     isFar: boolean}} Result */

/** What the studio works on, shared by its modules. A shape that is read has a training without a picture.
 * @type {{shape: StageShape | null, training: Partial<Training> | null, result: Result | null}} */
export const state = {shape: null, training: null, result: null};
/** With a shape on the stage. @typedef {typeof state & {shape: StageShape}} FullState */

/** Returns the shape's numbers for modelFile(). @type {(shape: FileShape) => FileShape} */
export const factsOfShape = ({name, center, scale, up, front}) => ({name, center, scale, up, front});
