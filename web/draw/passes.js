import {shared} from "../model/facts.js";
import {gridOf} from "./cells.js";

// Draws one sample of a rectangle of pixels with a variant's programs, step after step (FRAME in
// codegen/targets/shader.py).
/** @import {Device} from "./device.js"
 * @import {Tile} from "./painter.js"
 * @import {Uniforms} from "./uniforms.js" */
const CELL_UNIT = 1; // texture unit of the grid of cells; unit 0 is the default
export const POINTS_UNIT = 2; // texture unit of the points of packed samples
// Texture units of the passes' targets. rays: of mask_near.glsl and trace.glsl; normals: of gradient.glsl before
// trace.glsl; late_normals: of gradient.glsl after it; mask: of a pass in blocks; floor_light: of floor.glsl.
const READ_UNITS = {rays: 3, normals: 4, late_normals: 5, mask: 6, floor_light: 7};
const BLOCK = 2; // pixels along the side of a block (blocks.vert.glsl)
const IN_BLOCKS = ["gradient", "trace", "color"]; // passes that draw only where an earlier pass set the mask
const PER_LEVEL = ["delta", "step_bound", "band_step_bound"]; // uniforms that are arrays of floats

export class Passes {
    /** @type {Cells & {time: number, texture: WebGLTexture} | null} */ cells = null;

    /** target(): creates a target of the size of the largest rectangle.
     * @param {Device} device @param {() => Target} target */
    constructor(device, target) {
        // Without targets of floats there are none, and one program does all.
        const create = () => /** @type {Target} */ (device.float ? target() : null);
        this.device = device;
        this.rays = create();
        this.normals = create();
        this.late = create();
        this.floor = create();
    }

    /** Returns the names of a variant's passes. Literals are text without loops, which a CPU evaluates for every
     * pixel: passes skip pixels that need no evaluation. A loop over texels skips itself; with a texture,
     * glsl/functions/trace_with_normal.glsl does all in one draw.
     * @param {string} storage */
    names(storage) {
        return this.rays && storage === "literal" ? [...new Set(Object.values(shared.frame))] : ["single_pass"];
    }

    /** Whether a pass draws blocks of pixels with blocks.vert.glsl, only where an earlier pass set the mask.
     * @param {string} name */
    inBlocks(name) {
        return IN_BLOCKS.includes(name);
    }

    /** Returns the macros of a model's passes. A scene has no grid of cells, and its rays take no Newton's step first.
     * @param {Model} model */
    defines({field}) {
        return ["CELLS", "BLOCKS", ...(field ? [] : ["NEWTON"])].map((macro) => `#define ${macro}\n`).join("");
    }

    /** Sets the grids of cells by which the model's rays skip, or null. @param {Cells | null} cells */
    setCells(cells) {
        this.device.gl.deleteTexture(this.cells?.texture ?? null);
        this.cells = cells && {...cells, time: 0, texture: this.device.grid(cells.count)};
        if (this.cells) this.device.fill(this.cells.texture, this.cells.count, this.cells.grids[0]);
    }

    /** Uploads the grid of a time. @param {number} time */
    setTime(time) {
        const {cells} = this;
        if (!cells || cells.grids.length === 1 || time === cells.time) return;
        this.device.fill(cells.texture, cells.count, gridOf(cells, time));
        cells.time = time;
    }

    /** Draws a rectangle [column, row, width, height] of the target `tile`. values: of the uniforms; places: a
     * texture.
     * @param {Variant} variant @param {Uniforms & {origin: number[]}} values @param {Tile} rectangle
     * @param {{tile: Target, places: WebGLTexture}} painter */
    draw({programs, weights}, values, rectangle, {tile, places}) {
        const {gl} = this.device, {rays, normals, late, cells} = this;
        // The current grid: a finer one may exist since `values` was computed.
        /** @type {Record<string, number | number[]>} */ const all = {...values, cell_count: 0};
        if (cells && values.skips) Object.assign(all, {cell_count: cells.count, cells_half: [cells.half]});
        this.setTime(values.time[0]);
        gl.activeTexture(gl.TEXTURE0 + CELL_UNIT);
        gl.bindTexture(gl.TEXTURE_3D, cells?.texture ?? null);
        this.bind(POINTS_UNIT, places);
        this.bind(0, weights);
        if (programs.single_pass) return this.pass(programs.single_pass, all, tile, rectangle, {});
        const shading = shared.shadings[values.shading], hasFloor = shading === "softbox";
        const {newton} = values; // Newton's step writes a negative alpha for the rays that remain
        const left = {wanted: [newton ? -1 : 1]}, near = newton ? rays : tile;
        /** @type {Record<string, [Target, Record<string, Target>?, object?] | 0 | false>} Step -> target, textures that
         * it reads, further uniforms; steps that the options do not need are absent. */
        const steps = {
            near: [near],
            newton: newton && [normals, {rays, mask: rays}],
            trace: [rays, {normals, mask: newton ? normals : near}, left],
            normals: [late, {rays, mask: newton ? normals : rays}, {...left, newton: 0}],
            background: [tile, {rays, normals}],
            color: !["steps", "data"].includes(shading) && [
                tile,
                {rays, normals, late_normals: late, mask: rays, floor_light: this.floor},
                {everywhere: Number(hasFloor)},
            ],
        };
        this.clear([rays, normals], rectangle);
        for (const [step, name] of Object.entries(shared.frame)) {
            const [target, read, more] = steps[step] || [];
            if (step === "floor" && hasFloor && !values.scattered)
                all.floor_corner = this.drawFloor(programs.floor, values, rectangle);
            else if (target) this.pass(programs[name], {...all, ...more}, target, rectangle, read ?? {});
        }
    }

    /** Evaluates the floor at the corners of a rectangle's blocks, and of the blocks around them. Returns the first
     * corner, in blocks from the picture's lower left corner.
     * @param {Program} program @param {Uniforms & {origin: number[]}} values @param {Tile} rectangle */
    drawFloor(program, values, [column, row, width, height]) {
        const block = (/** @type {number} */ pixel) => Math.floor(pixel / shared.floor_block);
        const [x, y] = [values.origin[0] + column, values.origin[1] + row], corner = [block(x) - 1, block(y) - 1];
        const columns = block(x + width - 1) + 3 - corner[0], rows = block(y + height - 1) + 3 - corner[1];
        this.pass(program, {...values, floor_corner: corner}, this.floor, [0, 0, columns, rows], {});
        return corner;
    }

    /** @param {Target[]} targets @param {Tile} rectangle */
    clear(targets, rectangle) {
        const {gl} = this.device;
        gl.enable(gl.SCISSOR_TEST);
        gl.scissor(...rectangle);
        for (const {framebuffer} of targets) {
            gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
            gl.clear(gl.COLOR_BUFFER_BIT);
        }
        gl.disable(gl.SCISSOR_TEST);
    }

    /** Binds a texture, or none, to a unit, and selects unit 0 again.
     * @param {number} unit @param {WebGLTexture | null} texture */
    bind(unit, texture) {
        const {gl} = this.device;
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.activeTexture(gl.TEXTURE0);
    }

    /** Draws one program to a rectangle of a target. read: the targets that it reads, by their names in glsl/.
     * @param {Program} program @param {Record<string, number | number[]>} values @param {Target} target
     * @param {number[]} rectangle @param {Record<string, Target>} read */
    pass({program, names, inBlocks}, values, {framebuffer}, rectangle, read) {
        const {gl} = this.device, [column, row, width, height] = rectangle;
        gl.useProgram(program);
        for (const [name, unit] of Object.entries(READ_UNITS)) {
            this.bind(unit, read[name]?.texture ?? null);
            if (names[name]) gl.uniform1i(names[name], unit);
        }
        if (names.cells) gl.uniform1i(names.cells, CELL_UNIT);
        if (names.points) gl.uniform1i(names.points, POINTS_UNIT);
        if (inBlocks) gl.uniform4i(names.viewport, column, row, width, height);
        for (const [name, value] of Object.entries({wanted: [1], everywhere: 0, ...values})) {
            const location = names[name];
            if (!location) continue;
            if (typeof value === "number") gl.uniform1i(location, value);
            else if (name === "camera") gl.uniformMatrix4fv(location, false, value);
            else if (name === "iterations") gl.uniform1iv(location, value);
            else if (PER_LEVEL.includes(name) || value.length === 1) gl.uniform1fv(location, value);
            else gl[/** @type {"uniform4fv"} */ (`uniform${value.length}fv`)](location, value);
        }
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        gl.viewport(column, row, width, height);
        if (inBlocks) gl.drawArrays(gl.POINTS, 0, Math.ceil(width / BLOCK) * Math.ceil(height / BLOCK));
        else gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
}
