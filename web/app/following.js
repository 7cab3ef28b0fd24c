// During motion, where the device is too slow for coarse pixels: the last good picture, reprojected to the present
// camera, while a picture of enough pixels is drawn for the next one.
const ENOUGH = 1 / 2; // least resolution of a picture, along each axis, that may replace a better one
const FARTHEST_TURN = 25; // degrees of a reprojection; farther, the picture waits

export class Following {
    constructor(renderer) {
        this.renderer = renderer;
        this.scene = null; // of the good picture: `shown`, or without one renderer.still; null: there is none
        this.shown = this.coming = null; // {picture, camera}: the good picture; the one in work, also with its pass
    }

    get size() {
        return this.renderer.size.map((side) => Math.max(1, Math.round(ENOUGH * side)));
    }

    // Whether enough pixels take too long for a frame, while the canvas shows a good picture of the same model with the
    // same options, or is covered by one.
    get isBetter() {
        const {scene, pace, motion, fresh, variants, listener} = this.renderer, [width, height] = this.size;
        const isSlow = variants.current.cost * width * height > motion.goal;
        if (!isSlow || fresh || pace !== motion || scene.options.resolution !== "auto") return false;
        const options = (of) => JSON.stringify(of.options);
        return Boolean(this.scene ? this.scene.model === scene.model && options(this.scene) === options(scene)
            : listener.covered?.());
    }

    // Draws the next tiles, and the good picture; at rest, leaves both to the refinement.
    async step() {
        const {renderer} = this, {painter, scene} = renderer, {current} = renderer.variants;
        if (!this.shown && this.scene) {
            this.shown = {picture: renderer.still, camera: this.scene.camera};
            renderer.still = null;
        }
        if (performance.now() >= renderer.restAt) return this.shown ? this.rest() : renderer.drawQuick();
        this.coming ??= {
            camera: scene.camera, picture: painter.sized(null, this.size),
            pass: renderer.pass(scene, this.size, 0), spent: 0,
        };
        const {coming} = this;
        coming.spent += await painter.batch(current, coming.pass, coming.picture, 1);
        if (!coming.pass.tiles.length) {
            const {picture: {width, height}, spent} = coming;
            this.forget("shown");
            Object.assign(this, {shown: coming, coming: null, scene: {...scene}});
            renderer.listener.frame({milliseconds: spent, size: [width, height], samples: 1, settled: false});
        }
        if (this.shown) this.put();
    }

    // Draws the good picture to the canvas, or, as linear light, to another picture.
    put(onto = null) {
        const {painter, scene} = this.renderer, {picture, camera} = this.shown;
        const near = (angle, start) => (
            start + Math.max(-FARTHEST_TURN, Math.min(FARTHEST_TURN, (angle - start + 540) % 360 - 180)));
        const azimuth = near(scene.camera.azimuth, camera.azimuth);
        const elevation = near(scene.camera.elevation, camera.elevation);
        painter.put(picture, onto, [camera, {...scene.camera, azimuth, elevation}]);
    }

    // Begins the refinement, with the good picture.
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

    // renderer.still is a good picture of the present scene.
    keep() {
        this.spoil();
        this.scene = {...this.renderer.scene};
    }

    // Forgets the good picture, because renderer.still is drawn anew.
    spoil() {
        this.forget("shown");
        this.forget("coming");
        this.scene = null;
    }

    forget(name) {
        if (this[name]) this.renderer.device.release(this[name].picture);
        this[name] = null;
    }
}
