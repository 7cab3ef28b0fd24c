import {shared} from "../model/facts.js";

// Backgrounds of a picture.
const LIGHT = 0.6; // mean of the channels above which a color is light, as in glsl/functions/background.glsl
/** @typedef {{tone: string, bottom: Vector, top: Vector}} Background */
/** @type {Record<string, Background>} */
export const BACKGROUNDS = {
    slate: {tone: "dark", bottom: shared.defaults.background_bottom, top: shared.defaults.background_top},
    night: {tone: "dark", bottom: [0.02, 0.02, 0.03], top: [0.07, 0.08, 0.11]},
    paper: {tone: "light", bottom: [0.85, 0.84, 0.81], top: [0.97, 0.965, 0.95]},
    sky: {tone: "light", bottom: [0.80, 0.85, 0.88], top: [0.55, 0.69, 0.80]},
};

/** Returns the background of six digits rrggbb; null for other text.
 * @param {string} text @returns {Background | null} */
export function plainBackground(text) {
    const digits = /^#?([0-9a-f]{6})$/i.exec(text)?.[1];
    if (!digits) return null;
    const color = [0, 2, 4].map((i) => parseInt(digits.slice(i, i + 2), 16) / 255);
    const mean = color.reduce((sum, channel) => sum + channel) / 3;
    return {tone: mean > LIGHT ? "light" : "dark", bottom: color, top: color};
}
