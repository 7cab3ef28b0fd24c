import {FOCAL, matrix} from "../draw/camera.js";
import {facts} from "../model/facts.js";

// Draws the dropped mesh or point cloud itself, before and beside the picture of its field.
const DOT = 0.012; // size of a cloud's points, model units

export class Preview {
    // canvas: over the picture; shader(name): returns the text of a file of glsl/. Without WebGL2, it draws nothing.
    constructor(canvas, shader) {
        const gl = canvas.getContext("webgl2", {antialias: true});
        Object.assign(this, {canvas, gl, up: "y", parts: [], textures: []});
        if (!gl) return;
        this.program = gl.createProgram();
        for (const [kind, name] of [[gl.VERTEX_SHADER, "preview.vert.glsl"], [gl.FRAGMENT_SHADER, "preview.glsl"]]) {
            const compiled = gl.createShader(kind);
            gl.shaderSource(compiled, `#version 300 es\nprecision highp float;\n${shader(name)}`);
            gl.compileShader(compiled);
            gl.attachShader(this.program, compiled);
        }
        gl.linkProgram(this.program);
        this.buffers = Array.from({length: 4}, () => gl.createBuffer());
        gl.enable(gl.DEPTH_TEST);
    }

    // Loads the buffers of cornersOf (preview_buffers.js).
    load({positions, normals, colors, places, parts, isCloud}) {
        const {gl} = this;
        Object.assign(this, {parts, isCloud, drawn: ""});
        if (!gl) return;
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

    texture({width, height, pixels}) {
        const {gl} = this, texture = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, width, height, 0, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        gl.generateMipmap(gl.TEXTURE_2D);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
        return texture;
    }

    // Draws at the next frame. camera, options: of view.js.
    show(camera, options) {
        if (!this.next) requestAnimationFrame(() => this.draw());
        this.next = {camera, options};
    }

    draw() {
        const {gl, canvas, program, next: {camera, options: {light, shading}}} = this, scale = devicePixelRatio || 1;
        const [width, height] = ["Width", "Height"].map((side) => Math.round(canvas[`client${side}`] * scale));
        const seen = JSON.stringify([camera, light, shading, this.up, width, height]);
        this.next = null;
        if (!gl || !width || seen === this.drawn) return; // large meshes take the processor seconds
        this.drawn = seen;
        Object.assign(canvas, {width, height});
        const aspect = width / height, at = (name) => gl.getUniformLocation(program, name);
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
