import {shared} from "./facts.js";
import {TEXTURE_WIDTH} from "./texels.js";

// WebGL2 as the renderer uses it. What a device cannot do is a DeviceError, whose message is one line for the visitor.
export class DeviceError extends Error {}
class ContextLost extends Error {}

const VERTEX = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }
`;

export class Device {
    constructor(canvas) {
        const buffers = {alpha: false, antialias: false, depth: false, stencil: false};
        this.gl = canvas.getContext("webgl2", {...buffers, powerPreference: "high-performance"});
        if (!this.gl) {
            throw new DeviceError("This browser shows no WebGL2, which the picture needs. "
                + "Try a current Firefox, Chrome, Edge or Safari, with graphics acceleration switched on.");
        }
        const gl = this.gl;
        this.float = Boolean(gl.getExtension("EXT_color_buffer_float"));
        this.half = this.float || Boolean(gl.getExtension("EXT_color_buffer_half_float"));
        this.parallel = gl.getExtension("KHR_parallel_shader_compile");
        // Samples have one format in every draw, because software GL compiles the shader again for each new one.
        this.sampleFormat = this.float ? gl.RGBA32F : gl.RGBA8;
        this.pictureFormat = this.half ? gl.RGBA16F : gl.SRGB8_ALPHA8;
        gl.bindVertexArray(gl.createVertexArray());
    }

    get lost() {
        return this.gl.isContextLost();
    }

    // The driver's own name, where the browser tells it; else what the browser says instead.
    get name() {
        const gl = this.gl, plain = String(gl.getParameter(gl.RENDERER));
        if (plain !== "WebKit WebGL") return plain;
        const info = gl.getExtension("WEBGL_debug_renderer_info");
        return info ? String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : plain;
    }

    // Whether the driver stops a fragment after a number of loop iterations, for which uniforms.js chooses fewer.
    get limitsLoops() {
        return /llvmpipe/i.test(this.name);
    }

    // SwiftShader has 512 KiB of stack for all that a fragment keeps. Each term of a sum in the text takes some, and where
    // they do not suffice, its process dies at the first draw.
    get isShort() {
        return /swiftshader/i.test(this.name);
    }

    // Most products of a 4 x 4 block in one iteration of a loop.
    get unroll() {
        return this.isShort ? 2 : shared.unroll;
    }

    // Whether the device survives a text of literals: 3,105 terms took 90 % of the stack, 4,466 killed the process.
    survives(text) {
        return !this.isShort || text.split("+=").length < 3300;
    }

    // Throws DeviceError where a weight texture of so many rows, or the uniforms of so many levels, do not fit.
    check(height, levels) {
        if (this.lost) return;
        const gl = this.gl, side = gl.getParameter(gl.MAX_TEXTURE_SIZE);
        if (Math.max(TEXTURE_WIDTH, height) > side) {
            throw new DeviceError(`The weights need a texture of ${TEXTURE_WIDTH} x ${height}; `
                + `this device's largest side is ${side}.`);
        }
        const vectors = gl.getParameter(gl.MAX_FRAGMENT_UNIFORM_VECTORS), needed = 2 * levels + 20;
        if (needed > vectors)
            throw new DeviceError(`The shader needs ${needed} uniform vectors; this device has ${vectors}.`);
    }

    // Begins to compile a fragment shader with a vertex shader, by default a triangle that covers all, beside everything else where the browser can, and returns
    // {program, shaders, sync}, which isReady and finish take.
    begin(fragment, vertex = VERTEX) {
        const gl = this.gl, program = gl.createProgram();
        const shaders = [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]].map(([kind, text]) => {
            const shader = gl.createShader(kind);
            gl.shaderSource(shader, text);
            gl.compileShader(shader);
            gl.attachShader(program, shader);
            return shader;
        });
        gl.linkProgram(program);
        // Without the extension, asking about the program would wait for its compiler; a fence behind it does not.
        const sync = this.parallel ? null : gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
        gl.flush();
        return {program, shaders, sync};
    }

    // Whether the compiler is done, or the context is lost.
    isReady({program, sync}) {
        const {gl} = this;
        if (this.lost) return true;
        return sync ? gl.getSyncParameter(sync, gl.SYNC_STATUS) === gl.SIGNALED
            : gl.getProgramParameter(program, this.parallel.COMPLETION_STATUS_KHR);
    }

    // Whether a program that compiles for minutes would hold up nothing else: Direct3D's compiler is the slow one.
    get patient() {
        return Boolean(this.parallel) || !/direct3d|d3d/i.test(this.name);
    }

    // Returns {program, names} of what `begin` began, where `names` maps each uniform to its location.
    // Throws DeviceError with the first line that the compiler said.
    finish({program, shaders}) {
        const gl = this.gl;
        if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !this.lost) {
            const log = shaders.map((shader) => gl.getShaderInfoLog(shader)).join("\n") + gl.getProgramInfoLog(program);
            const line = log.split("\n").find((text) => text.trim()) ?? "no reason given";
            gl.deleteProgram(program);
            throw new DeviceError(`This device's compiler refuses the shader: ${line.trim().slice(0, 200)}`);
        }
        shaders.forEach((shader) => gl.deleteShader(shader));
        const names = {}, count = this.lost ? 0 : gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
        for (let i = 0; i < count; ++i) {
            const {name} = gl.getActiveUniform(program, i);
            names[name.replace("[0]", "")] = gl.getUniformLocation(program, name);
        }
        return {program, names};
    }

    // Returns a texture of width x height texels; values: a Float32Array with four numbers for each, or null.
    texture(format, width, height, filter, values = null) {
        const gl = this.gl, texture = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
        if (values) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RGBA, gl.FLOAT, values);
        const set = (name, value) => gl.texParameteri(gl.TEXTURE_2D, name, value);
        for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) set(name, filter);
        for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) set(name, gl.CLAMP_TO_EDGE);
        return texture;
    }

    // Returns a texture for a grid of count ** 3 bytes.
    grid(count) {
        const gl = this.gl, texture = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_3D, texture);
        gl.texStorage3D(gl.TEXTURE_3D, 1, gl.R8UI, count, count, count);
        for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
            gl.texParameteri(gl.TEXTURE_3D, name, gl.NEAREST);
        return texture;
    }

    // Writes a grid into its texture.
    fill(texture, count, values) {
        const gl = this.gl;
        gl.bindTexture(gl.TEXTURE_3D, texture);
        gl.texSubImage3D(gl.TEXTURE_3D, 0, 0, 0, 0, count, count, count, gl.RED_INTEGER, gl.UNSIGNED_BYTE, values);
    }

    // Returns {texture, framebuffer, width, height}, which can be drawn to and read as a texture.
    target(format, width, height, filter) {
        const gl = this.gl, texture = this.texture(format, width, height, filter), framebuffer = gl.createFramebuffer();
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
        return {texture, framebuffer, width, height};
    }

    release({texture, framebuffer}) {
        this.gl.deleteFramebuffer(framebuffer);
        this.gl.deleteTexture(texture);
    }

    // Resolves when everything drawn so far is done, without blocking the page. Throws ContextLost.
    async done() {
        const gl = this.gl, sync = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
        gl.flush();
        while (!this.lost && gl.getSyncParameter(sync, gl.SYNC_STATUS) !== gl.SIGNALED) await pause(1);
        gl.deleteSync(sync);
        if (this.lost) throw new ContextLost();
    }

    // Returns what the promise `work` gives. An error of a lost context is left out: recovery.js tells the visitor of
    // it.
    async unlessLost(work) {
        try {
            return await work;
        } catch (error) {
            if (!(error instanceof ContextLost) && !this.lost) throw error;
        }
    }
}

export const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));
export const nextFrame = () => new Promise((resolve) => requestAnimationFrame(resolve));
