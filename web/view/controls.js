// Controls of the panel. Each calls back when the visitor changes it.

/** Fills a fieldset with a button for each choice {value, label, paint}; paint: CSS background instead of the label.
 * @template T @param {HTMLElement} fieldset @param {{value: T, label: string, paint?: string}[]} choices
 * @param {T} chosen @param {(value: T) => void} onChoose */
export function fillChoices(fieldset, choices, chosen, onChoose) {
    fieldset.querySelectorAll("label").forEach((label) => label.remove());
    for (const {value, label, paint} of choices) {
        const [row, input, face] = /** @type {[HTMLElement, HTMLInputElement, HTMLElement]} */ (
            ["label", "input", "span"].map((tag) => document.createElement(tag))
        );
        Object.assign(input, {type: "radio", name: fieldset.id, value: String(value), checked: value === chosen});
        input.addEventListener("change", () => onChoose(value));
        if (paint) {
            face.style.background = paint;
            row.title = label;
            input.setAttribute("aria-label", label);
        } else {
            face.textContent = label;
        }
        row.append(input, face);
        fieldset.append(row);
    }
}

/** Checks a choice without a callback. @param {HTMLElement} fieldset @param {unknown} value */
export function choose(fieldset, value) {
    const input = [...fieldset.querySelectorAll("input")].find((button) => button.value === String(value));
    if (input) input.checked = true;
}

/** A ball with the light of the shape; a touch sets the direction of the light. light: unit vector [x, y, z], camera
 * space, z >= 0.
 * @param {HTMLElement} ball @param {Vector} light @param {(light: Vector) => void} onMove */
export function lightBall(ball, light, onMove) {
    const put = (/** @type {number} */ x, /** @type {number} */ y) => {
        const length = Math.hypot(x, y), shrink = length > 0.98 ? 0.98 / length : 1;
        light = [x * shrink, y * shrink, Math.sqrt(1 - (Math.min(length, 0.98)) ** 2)];
        ball.style.setProperty("--x", `${50 + 46 * light[0]}%`);
        ball.style.setProperty("--y", `${50 - 46 * light[1]}%`);
        const degrees = (/** @type {number} */ radians) => Math.round(radians * 180 / Math.PI);
        const around = degrees(Math.atan2(light[1], light[0])), away = degrees(Math.acos(light[2]));
        ball.setAttribute("aria-valuenow", String(around));
        ball.setAttribute("aria-valuetext", `${around} degrees from the right, ${away} from the viewer`);
    };
    const follow = (/** @type {PointerEvent} */ event) => {
        const box = ball.getBoundingClientRect();
        put(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height);
        onMove(light);
    };
    ball.addEventListener("pointerdown", (event) => {
        ball.setPointerCapture(event.pointerId);
        follow(event);
    });
    ball.addEventListener("pointermove", (event) => {
        if (event.buttons) follow(event);
    });
    ball.addEventListener("keydown", (event) => {
        /** @type {Record<string, number[]>} */
        const steps = {ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]};
        const step = steps[event.key];
        if (!step) return;
        event.preventDefault();
        put(light[0] + step[0], light[1] + step[1]);
        onMove(light);
    });
    put(light[0], light[1]);
}

/** Calls back with what was dropped on the page, a DataTransfer; shows `cover` while a file is dragged over the page.
 * @param {HTMLElement} cover @param {(transfer: DataTransfer) => void} onDrop */
export function listenToDrops(cover, onDrop) {
    const hasFiles = (/** @type {DragEvent} */ event) => event.dataTransfer?.types.includes("Files");
    addEventListener("dragover", (event) => {
        if (!hasFiles(event)) return;
        event.preventDefault();
        cover.hidden = false;
    });
    addEventListener("dragleave", (event) => {
        if (!event.relatedTarget) cover.hidden = true;
    });
    addEventListener("drop", (event) => {
        cover.hidden = true;
        if (!hasFiles(event)) return;
        event.preventDefault();
        if (event.dataTransfer) onDrop(event.dataTransfer);
    });
}

/** Copies text, also in browsers without an asynchronous clipboard. @param {string | Promise<string>} text */
export async function copyText(text) {
    try {
        await navigator.clipboard.write([new ClipboardItem({"text/plain": Promise.resolve(text)})]);
    } catch {
        const area = document.createElement("textarea");
        area.value = await text;
        document.body.append(area);
        area.select();
        document.execCommand("copy");
        area.remove();
    }
}

/** Saves a Blob as a file. name: any text. @param {Blob} blob @param {string} name @param {string} ending */
export function saveFile(blob, name, ending) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = `${name.replace(/[^\p{L}\p{N}_-]+/gu, "-").slice(0, 60)}.${ending}`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
