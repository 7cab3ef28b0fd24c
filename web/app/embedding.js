// What the URL's hash asks for where the page is a part of another one, beside the camera: `panel=0` leaves out panel
// and text, `turntable=SECONDS` turns the shape, once in so many seconds, `background=` is a name or six digits rrggbb.
const inHash = new URLSearchParams(location.hash.slice(1));
const [FASTEST, SLOWEST] = [2, 3600]; // seconds
const LIGHT = 0.6; // mean of the channels from which a colour is a light one, as in glsl/background.glsl

// Whether a view or a time is asked for, other than the first one.
export const namesView = ["az", "el", "d", "at", "t"].some((key) => inHash.has(key));

// Seconds of a turn of the shape; 0: it rests.
export const turnTime = (() => {
    const seconds = Number(inHash.get("turntable"));
    const isWelcome = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    return isWelcome && seconds >= FASTEST && seconds <= SLOWEST ? seconds : 0;
})();

export const askedBackground = inHash.get("background") ?? "";

// The end of the hash that keeps all this when the camera is written into it.
export const keptInHash = ["panel", "turntable", "background"].filter((key) => inHash.has(key))
    .map((key) => `&${key}=${encodeURIComponent(inHash.get(key))}`).join("");

// Returns the background that six digits rrggbb mean, with its tone; null for any other text.
export function plainBackground(text) {
    const digits = /^#?([0-9a-f]{6})$/i.exec(text)?.[1];
    if (!digits) return null;
    const colour = [0, 2, 4].map((i) => parseInt(digits.slice(i, i + 2), 16) / 255);
    const mean = colour.reduce((sum, channel) => sum + channel) / 3;
    return {tone: mean > LIGHT ? "light" : "dark", bottom: colour, top: colour};
}
