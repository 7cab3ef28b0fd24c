/** @typedef {(right: number, up: number) => void} Move */

/** Calls turn, pan, zoom and reset for mouse and touch; pan and zoom may be null. `right` and `up` are shares of the
 * canvas's height. Drag: turn. Drag with the right or middle button, or with shift: pan. Wheel: zoom, where
 * takesWheel(event). One finger turns, two pan and pinch. sideways: pixels that a lone finger first moves to the
 * side, where it scrolls the page up and down.
 * @param {HTMLElement} canvas
 * @param {{turn: Move, pan: Move | null, zoom: ((factor: number) => void) | null, reset: () => void,
 * takesWheel?: (event: WheelEvent) => boolean, sideways?: number}} gestures */
export function listenToPointers(canvas, {turn, pan, zoom, reset, takesWheel = () => true, sideways = 0}) {
    /** @type {Map<number, {x: number, y: number, moved?: boolean}>} */ const fingers = new Map();
    const center = () => {
        const all = [...fingers.values()];
        const mean = (/** @type {"x" | "y"} */ axis) =>
            all.reduce((total, finger) => total + finger[axis], 0) / all.length;
        const spread = all.length > 1 ? Math.hypot(all[0].x - all[1].x, all[0].y - all[1].y) : 0;
        return {x: mean("x"), y: mean("y"), spread};
    };
    canvas.addEventListener("pointerdown", (event) => {
        canvas.focus({preventScroll: true});
        canvas.setPointerCapture(event.pointerId);
        fingers.set(event.pointerId, {x: event.clientX, y: event.clientY});
    });
    canvas.addEventListener("pointermove", (event) => {
        const finger = fingers.get(event.pointerId), isAlone = event.pointerType === "touch" && fingers.size === 1;
        if (!finger || isAlone && !finger.moved && Math.abs(event.clientX - finger.x) < sideways) return;
        const before = center();
        fingers.set(event.pointerId, {x: event.clientX, y: event.clientY, moved: true});
        const after = center(), height = canvas.clientHeight;
        const right = (after.x - before.x) / height, up = (before.y - after.y) / height;
        if (fingers.size > 1 || event.shiftKey || event.buttons & 6) pan?.(right, up);
        else turn(right, up);
        if (before.spread && after.spread) zoom?.(before.spread / after.spread);
    });
    for (const kind of /** @type {const} */ (["pointerup", "pointercancel"]))
        canvas.addEventListener(kind, (event) => fingers.delete(event.pointerId));
    canvas.addEventListener("wheel", (event) => {
        if (!zoom || !takesWheel(event)) return;
        event.preventDefault();
        const notches = event.deltaY * [1 / 100, 1 / 3, 1][event.deltaMode];
        zoom(1.1 ** Math.max(-5, Math.min(5, event.ctrlKey ? 8 * notches : notches)));
    }, {passive: false});
    canvas.addEventListener("dblclick", reset);
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
}

/** Calls actions, an object from keys to functions, except for keys that the focused control uses. target: what gets
 * the keys.
 * @param {Record<string, (event: KeyboardEvent) => void>} actions @param {Window | HTMLElement} target */
export function listenToKeys(actions, target = window) {
    /** @type {Window} */ (target).addEventListener("keydown", (event) => {
        if (event.ctrlKey || event.metaKey || event.altKey) return;
        const control = /** @type {Element} */ (event.target).closest?.("input, button, #light"),
            isButton = control?.localName === "button";
        const isNeeded = control && (isButton ? / / : /^(Arrow|Home|End|Page| )/).test(event.key);
        const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
        if (isNeeded || !Object.hasOwn(actions, key)) return;
        event.preventDefault();
        actions[key](event);
    });
}
