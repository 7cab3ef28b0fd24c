import {FOCAL, matrix} from "../draw/camera.js";
import {facts} from "../model/facts.js";
/** @import {Picture} from "../read/mesh_file.js" */
/** @import {PreviewBuffers, PreviewPart} from "./preview_buffers.js" */
const DOT = 0.012; // size of a cloud's points, model units

/** Draws the dropped mesh or point cloud itself, before and beside the picture of its field. */
export class Preview {
    /** Without WebGL2, it draws nothing. @param {HTMLCanvasElement} canvas over the picture
     * @param {(name: string) => string} shader returns the text of a file of glsl/ */
    constructor(canvas, shader) {
        const gl = canvas.getContext("webgl2", {antialias: true});
        this.canvas = canvas;
        this.gl = gl;
        /** @type {Up} */
        this.up = "y";
        this.drawn = "";
        this.isCloud = false;
        /** @type {PreviewPart[]} */
        this.parts = [];
        /** @type {(WebGLTexture | null)[]} */
        this.textures = [];
        /** @type {WebGLBuffer[]} */
        this.buffers = [];
        /** @type {{camera: Camera, options: Options} | null} */
        this.next = null;
        const program = this.program = gl && gl.createProgram();
        if (!gl || !program) return;
        /** @type {[number, string][]} */
        const parts = [[gl.VERTEX_SHADER, "preview.vert.glsl"], [gl.FRAGMENT_SHADER, "preview.glsl"]];
        for (const [kind, name] of parts) {
            const compiled = /** @type {WebGLShader} */ (gl.createShader(kind));
            gl.shaderSource(compiled, `#version 300 es\nprecision highp float;\n${shader(name)}`);
            gl.compileShader(compiled);
            gl.attachShader(program, compiled);
        }
        gl.linkProgram(program);
        this.buffers = Array.from({length: 4}, () => gl.createBuffer());
        gl.enable(gl.DEPTH_TEST);
    }

    /** @param {PreviewBuffers} buffers */
    load({positions, normals, colors, places, parts, isCloud}) {
        const {gl} = this;
        this.parts = parts;
        this.isCloud = isCloud;
        this.drawn = "";
        if (!gl) return;
        /** @type {[AllowSharedBufferSource | null, number, number][]} */
        const columns = [[positions, 3, gl.FLOAT], [normals, 4, gl.BYTE], [colors, 4, gl.UNSIGNED_BYTE], [
            places,
            2,
            gl.FLOAT,
        ]];
        columns.forEach(([values, size, type], k) => {
            if (!values) return gl.disableVertexAttribArray(k);
            gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[k]);
            gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
            gl.enableVertexAttribArray(k);
            gl.vertexAttribPointer(k, size, type, type !== gl.FLOAT, 0, 0);
        });
        this.textures.forEach((texture) => gl.deleteTexture(texture));
        this.textures = parts.map(({image}) => (image ? this.texture(image) : null));
    }

    /** @param {Picture} picture */
    texture({width, height, pixels}) {
        const gl = /** @type {WebGL2RenderingContext} */ (this.gl), texture = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        gl.generateMipmap(gl.TEXTURE_2D);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
        return texture;
    }

    /** Draws at the next frame. @param {Camera} camera @param {Options} options */
    show(camera, options) {
        if (!this.next) requestAnimationFrame(() => this.draw());
        this.next = {camera, options};
    }

    draw() {
        const {gl, canvas, program} = this, scale = devicePixelRatio || 1;
        const {camera, options: {light, shading}} = /** @type {NonNullable<typeof this.next>} */ (this.next);
        const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((side) => Math.round(side * scale));
        const seen = JSON.stringify([camera, light, shading, this.up, width, height]);
        this.next = null;
        if (!gl || !program || !width || seen === this.drawn) return; // large meshes take the processor seconds
        this.drawn = seen;
        Object.assign(canvas, {width, height});
        const aspect = width / height, at = (/** @type {string} */ name) => gl.getUniformLocation(program, name);
        gl.viewport(0, 0, width, height);
        gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
        gl.useProgram(program);
        gl.uniformMatrix4fv(at("camera"), false, matrix(camera, aspect));
        gl.uniformMatrix3fv(at("turn"), true, facts.studio.upright[this.up].flat());
        const floats = {focal: FOCAL, aspect, dot_size: DOT * FOCAL * height / 2};
        for (const [name, value] of Object.entries(floats)) gl.uniform1f(at(name), value);
        gl.uniform3fv(at("light"), light);
        const flags = {faces: !this.isCloud, plain: shading === "texture", normals: shading === "normal"};
        for (const [name, value] of Object.entries(flags)) gl.uniform1i(at(name), Number(value));
        this.parts.forEach(({first, count, color}, k) => {
            gl.uniform1i(at("textured"), Number(Boolean(this.textures[k])));
            gl.uniform3fv(at("factor"), color ?? [1, 1, 1]);
            gl.bindTexture(gl.TEXTURE_2D, this.textures[k]);
            gl.drawArrays(this.isCloud ? gl.POINTS : gl.TRIANGLES, first, count);
        });
    }
}
