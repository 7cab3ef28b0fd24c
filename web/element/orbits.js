import {shared} from "../model/facts.js";

// Texts of the attributes that place and turn the camera of an element.
/** @type {Record<string, number>} */ const UNITS = {deg: 1, rad: 180 / Math.PI, "": 1};
export const TURN = 20; // seconds of a turntable's turn
const SPEED = 180 / 32; // degrees per second of auto-rotate
const FARTHEST_EYE = shared.camera.zoom[1];

/** @param {string | null | undefined} text @param {number} usual */
const angle = (text, usual) => {
    const [, number, unit] = /^(-?[\d.]+(?:e-?\d+)?)(deg|rad|)$/.exec(text ?? "") ?? [];
    return Number.isFinite(Number(number)) && unit in UNITS ? Number(number) * UNITS[unit] : usual;
};

/** Returns a camera from "THETA PHI RADIUS": azimuth and polar angle in deg or rad, and a distance in model units, or
 * in percent of the distance at which the shape fits; "auto" for the usual value. home: usual camera; fit: its
 * distance.
 * @param {string} text @param {Camera} home @param {number} fit */
export function readOrbit(text, home, fit) {
    const [theta, phi, radius = "auto"] = text.trim().split(/\s+/), value = parseFloat(radius);
    const distance = radius.endsWith("%") ? fit * value / 100 : value;
    const polar = Math.min(180, Math.max(0, angle(phi, 90 - home.elevation)));
    return {
        ...home,
        azimuth: angle(theta, home.azimuth),
        elevation: 90 - polar,
        distance: distance > 0 ? Math.min(distance, FARTHEST_EYE) : null,
    };
}

/** Returns {theta, phi: radians; radius: model units} of a camera. @param {Camera} camera @param {number} radius */
export function writtenOrbit({azimuth, elevation}, radius) {
    return {theta: azimuth * Math.PI / 180, phi: (90 - elevation) * Math.PI / 180, radius};
}

// Whether the visitor does not ask for less motion.
export const isMotionWelcome = () => !matchMedia("(prefers-reduced-motion: reduce)").matches;

/** Returns the seconds of a turn, 0 for none: of `turntable` (seconds), or of `auto-rotate` with
 * `rotation-per-second`.
 * @param {(name: string) => string | null} attribute */
export function readTurn(attribute) {
    if (attribute("turntable") !== null) return Number(attribute("turntable")) || TURN;
    return attribute("auto-rotate") === null ? 0 : 360 / (angle(attribute("rotation-per-second"), SPEED) || SPEED);
}
