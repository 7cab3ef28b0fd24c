import {shared} from "../model/facts.js";

// What a page in a frame takes from its host. Parameters in the URL's hash, beside the camera: `panel=0` hides panel and
// text, `turntable=SECONDS` sets the seconds per turn, `background=` is a name or rrggbb. And messages (docs/web.md).
const inHash = new URLSearchParams(location.hash.slice(1));
const [FASTEST, SLOWEST] = [2, 3600]; // seconds

// Whether the hash sets a view or a time.
export const hasView = ["az", "el", "d", "at", "t"].some((key) => inHash.has(key));

// Seconds per turn of the shape; 0 for no turntable.
export const turnTime = (() => {
    const seconds = Number(inHash.get("turntable"));
    const isWelcome = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    return isWelcome && seconds >= FASTEST && seconds <= SLOWEST ? seconds : 0;
})();

export const backgroundName = inHash.get("background") ?? "";

// The part of the hash that stays when the camera is written to it.
export const keptInHash = ["panel", "turntable", "background"].filter((key) => inHash.has(key))
    .map((key) => `&${key}=${encodeURIComponent(inHash.get(key) ?? "")}`).join("");

// Numbers in a message, with their least and largest values.
const FARTHEST_TARGET = shared.camera.zoom[1];
/** @type {Record<string, [number, number]>} */ const IN_MESSAGES = {
    azimuth: [-360, 360],
    elevation: [-90, 90],
    distance: shared.camera.zoom,
    level: [1, Infinity],
    time: [0, 1],
};

/** Posts a message to the host, if there is one. type: "ready" or "camera".
 * @param {string} type @param {object} numbers */
export function tellHost(type, numbers) {
    if (parent !== window) parent.postMessage({type: `mplicits-${type}`, ...numbers}, "*");
}

/** Calls back with the numbers in each message of the host, any of {azimuth, elevation, distance, target, level,
 * time}. A message with anything else in it is none.
 * @param {(numbers: Partial<Camera> & {level?: number, time?: number}) => void} onMessage */
export function listenToHost(onMessage) {
    /** @param {number} value @param {number[]} range */
    const isIn = (value, [least, most]) => Number.isFinite(value) && least <= value && value <= most;
    const isTarget = (/** @type {unknown} */ target) =>
        Array.isArray(target) && target.length === 3
        && target.every((c) => isIn(c, [-FARTHEST_TARGET, FARTHEST_TARGET]));
    addEventListener("message", ({source, data}) => {
        if (source !== parent || parent === window || data?.type !== "mplicits-set") return;
        const {type: _, ...numbers} = data;
        /** @param {[string, any]} entry */
        const isRight = (
            [key, value],
        ) => (key === "target" ?
            isTarget(value)
            : Object.hasOwn(IN_MESSAGES, key) && isIn(value, IN_MESSAGES[key]) && (key !== "level" || value % 1 === 0));
        if (Object.entries(numbers).every(isRight)) onMessage(numbers);
    });
}
