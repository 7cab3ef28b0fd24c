import {TURN} from "./orbits.js";

// The attributes of <mplicits-view> as properties: cameraOrbit is camera-orbit. Each function returns a property from the
// text of its attribute, null where there is none.
/** @typedef {string | null} Text of an attribute */
const asText = (/** @type {Text} */ text) => text, asFlag = (/** @type {Text} */ text) => text !== null;
const asNumber = (/** @type {number | null} */ usual) => (/** @type {Text} */ text) => (
    text === null ? null : Number(text) || usual
);
/** @typedef {Pick<import("./module.d.ts").MplicitsView, "src" | "model" | "poster" | "loading" | "reveal" | "shade" | "level"
 * | "background" | "cameraOrbit" | "cameraControls" | "disableZoom" | "disablePan" | "touchAction" | "alt" | "autoplay">} Properties */
export const ATTRIBUTES = {
    src: asText,
    model: asText,
    poster: asText,
    loading: asText,
    reveal: asText,
    shade: asText,
    level: asNumber(null),
    background: asText,
    "camera-orbit": asText,
    "camera-controls": asFlag,
    "disable-zoom": asFlag,
    "disable-pan": asFlag,
    "touch-action": asText,
    alt: asText,
    turntable: asNumber(TURN),
    "auto-rotate": asFlag,
    "rotation-per-second": asText,
    autoplay: asFlag,
};

/** Adds the properties to a prototype. Setting null or false removes the attribute. @param {HTMLElement} prototype */
export function addProperties(prototype) {
    for (const [name, read] of Object.entries(ATTRIBUTES)) {
        Object.defineProperty(prototype, name.replace(/-./g, ([, letter]) => letter.toUpperCase()), {
            configurable: true,
            enumerable: true,
            get() {
                return read(this.getAttribute(name));
            },
            set(value) {
                if (read === asFlag) this.toggleAttribute(name, Boolean(value));
                else if (value === undefined || value === null || value === false) this.removeAttribute(name);
                else this.setAttribute(name, value === true ? "" : value);
            },
        });
    }
}

/** Calls the setters of what a script set before the element was defined. @param {any} element */
export function adoptProperties(element) {
    for (const [name, value] of Object.entries(element)) {
        if (!(name in Object.getPrototypeOf(element))) continue;
        delete element[name];
        element[name] = value;
    }
}
