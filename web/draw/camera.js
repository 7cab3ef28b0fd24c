import {shared} from "../model/facts.js";

// The orbit camera around the unit sphere of model space, as in viewer/draw/camera.py, and its text in the URL's hash.
// The functions return new cameras.
const ORBIT = shared.camera;
const [NEAREST, FARTHEST] = ORBIT.zoom;
export const FOCAL = 1 / Math.tan(ORBIT.fov * Math.PI / 360); // 1 / tan(fov / 2), vertical

/** Returns the initial camera. front: azimuth and elevation of the model, or null.
 * @param {number[] | null | undefined} front @returns {Camera} */
export function homeOf(front) {
    const [azimuth, elevation] = front ?? [ORBIT.azimuth, ORBIT.elevation];
    return Object.freeze({azimuth, elevation, distance: null, target: Object.freeze([0, 0, 0])});
}

/** @param {Camera} camera @param {number} aspect */
function away(camera, aspect) {
    return camera.distance ?? ORBIT.margin / Math.sin(Math.atan(Math.min(1, aspect) / FOCAL));
}

/** Returns the camera as 16 numbers of a GL mat4: columns right, up, back, eye. aspect: width over height of the
 * picture.
 * @param {Camera} camera @param {number} aspect */
export function matrix(camera, aspect) {
    const a = camera.azimuth * Math.PI / 180, e = camera.elevation * Math.PI / 180;
    const right = [Math.cos(a), 0, -Math.sin(a)];
    const up = [-Math.sin(e) * Math.sin(a), Math.cos(e), -Math.sin(e) * Math.cos(a)];
    const back = [Math.cos(e) * Math.sin(a), Math.sin(e), Math.cos(e) * Math.cos(a)];
    const distance = away(camera, aspect);
    const eye = camera.target.map((c, i) => c + distance * back[i]);
    return [...right, 0, ...up, 0, ...back, 0, ...eye, 1];
}

/** Returns the camera after a rotation in degrees; the elevation stays between the poles.
 * @param {Camera} camera @param {number} azimuth @param {number} elevation */
export function orbited(camera, azimuth, elevation) {
    const turned = ((camera.azimuth + azimuth) % 360 + 360) % 360;
    return {...camera, azimuth: turned, elevation: Math.min(90, Math.max(-90, camera.elevation + elevation))};
}

/** Returns the camera at `factor` times the distance.
 * @param {Camera} camera @param {number} factor @param {number} aspect */
export function zoomed(camera, factor, aspect) {
    return {...camera, distance: Math.min(FARTHEST, Math.max(NEAREST, away(camera, aspect) * factor))};
}

/** Returns the camera with its target moved along the picture's axes, in shares of the picture's height.
 * @param {Camera} camera @param {number} right @param {number} up @param {number} aspect */
export function panned(camera, right, up, aspect) {
    const m = matrix(camera, aspect), height = 2 * away(camera, aspect) / FOCAL;
    return {...camera, target: camera.target.map((c, i) => c + height * (right * m[i] + up * m[4 + i]))};
}

/** @param {Camera} camera */
export function toHash(camera) {
    const short = (/** @type {number} */ x) => String(Number(x.toFixed(3)));
    const parts = [`az=${short(camera.azimuth)}`, `el=${short(camera.elevation)}`];
    if (camera.distance !== null) parts.push(`d=${short(camera.distance)}`);
    if (camera.target.some((c) => Math.abs(c) > 5e-4)) parts.push(`at=${camera.target.map(short).join(",")}`);
    return `#${parts.join("&")}`;
}

/** Returns the camera in a hash; missing or invalid values are those of `home`.
 * @param {string} hash @param {Camera} home @returns {Camera} */
export function fromHash(hash, home) {
    const parameters = new URLSearchParams(hash.replace(/^#/, ""));
    /** @param {string} key @param {number} least @param {number} most */
    const read = (key, least, most) => {
        const value = Number(parameters.get(key) || NaN);
        return value >= least && value <= most ? value : null;
    };
    const target = (parameters.get("at") ?? "").split(",").map(Number);
    return {
        azimuth: read("az", -360, 360) ?? home.azimuth,
        elevation: read("el", -90, 90) ?? home.elevation,
        distance: read("d", NEAREST, FARTHEST),
        target: target.length === 3 && target.every((c) => Math.abs(c) <= FARTHEST) ? target : [...home.target],
    };
}
