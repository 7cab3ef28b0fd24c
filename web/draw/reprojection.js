// During motion on a device that is too slow for coarse pixels in time: the last picture, reprojected to the present camera,
// while another is drawn.
export const COARSEST = 1 / 16; // smallest resolution relative to the canvas, along each axis
const ENOUGH = 1 / 2; // resolution from which a picture is good: it is reprojected rather than drawn coarsely
const HURRY = 400; // milliseconds for a picture in place of one that is not good, or too far away
const FARTHEST_TURN = 25; // degrees of a reprojection; farther, the picture waits

/** Returns the turn between two angles, degrees from -180 to 180. @param {number} angle @param {number} start */
const turnBetween = (angle, start) => (angle - start + 540) % 360 - 180;

/** Returns the angle nearest to `angle` to which a picture seen from the angle `start` may be reprojected.
 * @param {number} angle @param {number} start */
export const nearAngle = (angle, start) => (
    start + Math.max(-FARTHEST_TURN, Math.min(FARTHEST_TURN, turnBetween(angle, start)))
);

/** @import {Pass} from "./painter.js"
 * @import {Renderer} from "./renderer.js"
 * @typedef {{scene: Scene, scale: number, name?: "still" | "quick"}} Kept
 * @typedef {{picture: Target, camera: Camera, scale: number}} Shown
 * @typedef {Shown & {pass: Pass, isHurried: boolean, spent: number}} Coming */
export class Following {
    /** @type {Kept | null} Of the last picture; name: of a property of the renderer. */ kept = null;
    /** @type {Shown | null} The last picture. */ shown = null;
    /** @type {Coming | null} The one in work. */ coming = null;

    /** @param {Renderer} renderer */
    constructor(renderer) {
        this.renderer = renderer;
    }

    /** Milliseconds to draw a picture of a resolution. @param {number} scale */
    time(scale) {
        const {current, size: [width, height]} = this.renderer;
        return current.cost * width * height * scale ** 2;
    }

    // Whether frames take too long, while there is a picture of the same model with the same options.
    get isBetter() {
        const {scene, pace, motion} = this.renderer,
            {kept} = this,
            options = (/** @type {Scene} */ of) => JSON.stringify(of.options);
        if (!kept || pace !== motion || scene.options.resolution !== "auto") return false;
        const isSlow = this.time(kept.scale < ENOUGH ? COARSEST : ENOUGH) > motion.goal;
        return isSlow && kept.scene.model === scene.model && options(kept.scene) === options(scene);
    }

    // Whether the shown picture is good for the present camera.
    get isGood() {
        const shown = /** @type {Shown} */ (this.shown), {camera} = this.renderer.scene;
        const isNear = (/** @type {"azimuth" | "elevation"} */ angle) =>
            Math.abs(turnBetween(camera[angle], shown.camera[angle])) <= FARTHEST_TURN;
        return shown.scale >= ENOUGH && isNear("azimuth") && isNear("elevation");
    }

    // Draws the next tiles, and the last picture; at rest, leaves both to the refinement.
    async step() {
        const {renderer, kept} = this, {painter, scene, current} = renderer;
        if (!this.shown && kept?.name) {
            const picture = /** @type {Target} */ (renderer[kept.name]);
            this.shown = {picture, camera: kept.scene.camera, scale: kept.scale};
            renderer[kept.name] = null;
        }
        if (performance.now() >= renderer.restAt) return this.rest();
        const {isGood} = this, quick = Math.sqrt(HURRY / this.time(1));
        const scale = isGood ? ENOUGH : Math.max(COARSEST, Math.min(ENOUGH, quick));
        const {isHurried = null, scale: begun = 0} = this.coming ?? {};
        if (isHurried === isGood || begun > 2 * scale) this.forget("coming"); // the first tiles tell the time of the rest
        this.coming ??= this.begin(scale, !isGood);
        const {coming} = this;
        coming.spent += await painter.batch(current, coming.pass, coming.picture, 1);
        if (!coming.pass.tiles.length) {
            const {picture: {width, height}, spent, camera} = coming;
            this.forget("shown");
            Object.assign(this, {shown: coming, coming: null, kept: {scene: {...scene, camera}, scale: coming.scale}});
            renderer.listener.frame({milliseconds: spent, size: [width, height], samples: 1, settled: false});
        }
        this.put();
    }

    /** @param {number} scale @param {boolean} isHurried */
    begin(scale, isHurried) {
        const {painter, scene, size} = this.renderer, {camera} = scene;
        const pixels = size.map((side) => Math.max(1, Math.round(scale * side)));
        const picture = painter.sized(null, pixels), pass = this.renderer.pass(scene, pixels, 0);
        return {camera, picture, pass, scale, isHurried, spent: 0};
    }

    /** Draws the last picture to the canvas, or, as linear light, to another picture. @param {Target | null} onto */
    put(onto = null) {
        const {painter, scene} = this.renderer, {picture, camera} = /** @type {Shown} */ (this.shown);
        const azimuth = nearAngle(scene.camera.azimuth, camera.azimuth);
        const elevation = nearAngle(scene.camera.elevation, camera.elevation);
        painter.put(picture, onto, [camera, {...scene.camera, azimuth, elevation}]);
    }

    // Begins the refinement, with the last picture.
    rest() {
        const {renderer} = this, {painter, device} = renderer;
        this.forget("coming");
        if (renderer.quick) device.release(renderer.quick);
        renderer.quick = null;
        renderer.still = painter.sized(renderer.still, renderer.size);
        this.put(renderer.still);
        renderer.quicked = renderer.version;
        renderer.rest(0, 0);
    }

    /** The renderer's picture `name`, "still" or "quick", shows a scene at a resolution.
     * @param {"still" | "quick"} name @param {Scene} scene @param {number} scale */
    keep(name, scene, scale) {
        this.spoil();
        this.kept = {name, scene, scale};
    }

    // Forgets the picture, because it is drawn anew.
    spoil() {
        this.forget("shown");
        this.forget("coming");
        this.kept = null;
    }

    /** @param {"shown" | "coming"} name */
    forget(name) {
        const {picture} = this[name] ?? {};
        if (picture) this.renderer.device.release(picture);
        this[name] = null;
    }
}
