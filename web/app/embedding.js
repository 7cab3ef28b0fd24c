// Parameters in the URL's hash for embedded pages, beside the camera: `panel=0` hides panel and text,
// `turntable=SECONDS` sets the seconds per turn, `background=` is a name or rrggbb.
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
    .map((key) => `&${key}=${encodeURIComponent(inHash.get(key))}`).join("");
