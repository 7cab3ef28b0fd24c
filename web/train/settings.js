import {facts} from "../model/facts.js";
import {ModelError} from "../model/safetensors.js";

// The settings of a training, from texts in the form of the command line (trainer/settings.py).
const {presets, omegas: usual, omega_width: usualWidth, texture: widestTexture, limits, config} = facts.studio;

/** Returns the settings of a preset and of {levels, omegas, crease, seconds, seed}; an empty text is the preset's or
 * the default. Throws ModelError. @param {string} preset @param {Record<string, string>} texts @returns {Settings} */
export function settingsFrom(preset, texts) {
    const {levels: sizes, seconds, packed} = presets[preset], levels = levelsOf(texts.levels || sizes);
    const own = texts.omegas ? numbersOf("omega", texts.omegas, 1e-3, 1e4) : [];
    refuseIf(
        own.length && own.length !== levels.length && own.length !== levels.length + 1,
        `omega: ${levels.length} numbers are needed, one for each level (and one more for the texture)`,
    );
    const [widest, deepest, omega] = widestTexture, last = levels[levels.length - 1];
    return {
        levels,
        packed,
        texture: {width: Math.min(last.width, widest), depth: Math.min(last.depth, deepest)},
        omegas: [...levels.map(({width}, i) => own[i] ?? usualOmega(i, width)), own[levels.length] ?? omega],
        isUsual: !own.length,
        steps: null,
        seconds: texts.seconds ? numbersOf("seconds", texts.seconds, 1, 36000)[0] : seconds,
        crease: creaseOf(texts.crease?.trim()),
        seed: texts.seed ? Math.floor(numbersOf("seed", texts.seed, 0, 1e6)[0]) : 0,
    };
}

/** Returns settings with the omegas that suit a shape, where the visitor gave none (trainer/suited_omegas.py).
 * @param {Settings} settings @param {number} bend of bendOf() @returns {Settings} */
export function suitedSettings(settings, bend) {
    if (!settings.isUsual) return settings;
    const {smooth, rough, omegas: lowest} = config.bend, {levels, omegas} = settings;
    const share = Math.min(1, Math.max(0, (bend - smooth) / (rough - smooth)));
    const suited = [
        ...levels.map((_, i) => {
            const least = Math.min(omegas[i], lowest[Math.min(i, lowest.length - 1)]);
            return Number((least + share * (omegas[i] - least)).toFixed(1));
        }),
        omegas[levels.length],
    ];
    return {...settings, omegas: suited, isUsual: false};
}

/** @param {string} text @returns {Layout[]} */
function levelsOf(text) {
    const levels = text.split(",").map((part) => {
        const [, width, depth] = (/^\s*(\d{1,4})x(\d)\s*$/.exec(part) ?? []).map(Number);
        refuseIf(
            !(width >= 1 && width <= limits.width && depth <= limits.depth),
            `levels: "${
                part.trim().slice(0, 20)
            }" is not NxD, such as 64x2, with N up to ${limits.width} and D up to ${limits.depth}`,
        );
        return {width, depth};
    });
    refuseIf(levels.length > limits.levels, `levels: ${levels.length} levels; at most ${limits.levels}`);
    return levels;
}

/** @param {string | undefined} text */
function creaseOf(text) {
    return text === "flat" ? null : text ? numbersOf("crease", text, 0, 180)[0] : facts.studio.crease;
}

/** @param {string} name @param {string} text @param {number} least @param {number} most */
function numbersOf(name, text, least, most) {
    const numbers = text.split(",").map((part) => (part.trim() ? Number(part) : NaN));
    refuseIf(
        !numbers.every((number) => number >= least && number <= most),
        `${name}: "${text.slice(0, 30)}" is not a number from ${least} to ${most}`,
    );
    return numbers;
}

/** `default_omega` of trainer/settings.py. @param {number} level @param {number} width */
function usualOmega(level, width) {
    const omega = usual[Math.min(level, usual.length - 1)] * Math.min(1, Math.sqrt(width / usualWidth));
    return Number(omega.toFixed(1));
}

/** @param {unknown} condition @param {string} message */
function refuseIf(condition, message) {
    if (condition) throw new ModelError(message);
}
