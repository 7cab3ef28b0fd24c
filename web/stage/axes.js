import {matrix} from "../draw/camera.js";
import {turned} from "../model/orientation.js";

const NAMES = ["x", "y", "z"], LENGTH = 34, LETTER = 43; // of 50 units to the edge of the drawing
const SVG = "http://www.w3.org/2000/svg";

/** Shows the axes of the file, as seen by the camera, in a corner of the preview. */
export class Axes {
    /** @param {SVGSVGElement} drawing */
    constructor(drawing) {
        /** @type {Up} */
        this.up = "y";
        this.drawing = drawing;
        this.arms = NAMES.map((name) => {
            const [line, letter] = ["line", "text"].map((tag) => document.createElementNS(SVG, tag));
            letter.textContent = name.toUpperCase();
            for (const part of [line, letter]) part.setAttribute("class", `axis-${name}`);
            drawing.append(line, letter);
            return {line, letter};
        });
    }

    /** @param {Camera} camera */
    show(camera) {
        const m = matrix(camera, 1);
        this.arms.forEach(({line, letter}, k) => {
            const axis = turned([0, 1, 2].map((i) => Number(i === k)), this.up);
            const [right, up] = [0, 4].map((column) => axis.reduce((sum, c, i) => sum + c * m[column + i], 0));
            line.setAttribute("x2", `${LENGTH * right}`);
            line.setAttribute("y2", `${-LENGTH * up}`);
            letter.setAttribute("x", `${LETTER * right}`);
            letter.setAttribute("y", `${-LETTER * up}`);
        });
    }
}
