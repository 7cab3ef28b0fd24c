import {shared} from "../model/facts.js";
import {pause} from "../model/pause.js";
import {TEXTURE_WIDTH} from "../print/texels.js";

// A WebGL2 context. A DeviceError is a limit of the device, with a one-line message for the visitor.
export class DeviceError extends Error {}
class ContextLost extends Error {}

const VERTEX = `#version 300 es
void main() { gl_Position = vec4(vec2(int(gl_VertexID) & 1, int(gl_VertexID) >> 1) * 4.0 - 1.0, 0.0, 1.0); }
`;

export class Device {
    /** @param {HTMLCanvasElement} canvas */
    constructor(canvas) {
        const buffers = {alpha: false, antialias: false, depth: false, stencil: false};
        const gl = canvas.getContext("webgl2", {...buffers, powerPreference: "high-performance"});
        if (!gl) {
            throw new DeviceError(
                "This browser shows no WebGL2, which the picture needs. "
                    + "Try a current Firefox, Chrome, Edge or Safari, with graphics acceleration switched on.",
            );
        }
        this.gl = gl;
        this.float = Boolean(gl.getExtension("EXT_color_buffer_float"));
        this.half = this.float || Boolean(gl.getExtension("EXT_color_buffer_half_float"));
        this.parallel = gl.getExtension("KHR_parallel_shader_compile");
        // One format of samples, because software GL compiles the shader again for each format.
        this.sampleFormat = this.float ? gl.RGBA32F : gl.RGBA8;
        this.pictureFormat = this.half ? gl.RGBA16F : gl.SRGB8_ALPHA8;
        gl.bindVertexArray(gl.createVertexArray());
        this.name = driverName(gl); // a query waits for the driver, so it is asked once
        this.ended = false;
        canvas.addEventListener("webglcontextlost", () => {
            this.ended = true;
        }, {once: true});
    }

    // Stays true when the context comes back: it comes without its objects, for another Device.
    get lost() {
        return this.ended || this.gl.isContextLost();
    }

    // Whether the driver limits the loop iterations of a fragment (uniforms.js).
    get limitsLoops() {
        return /llvmpipe/i.test(this.name);
    }

    // Whether the processor draws.
    get isSoftware() {
        return this.limitsLoops || this.hasSmallStack;
    }

    // SwiftShader has 512 KiB of stack for a fragment. Each term of a sum takes part of the stack. A shader that needs
    // more stack kills the process at its first draw.
    get hasSmallStack() {
        return /swiftshader/i.test(this.name);
    }

    // Largest number of 4 x 4 products in one loop iteration.
    get unroll() {
        return this.hasSmallStack ? 2 : shared.unroll;
    }

    /** Whether the stack suffices for literals: 3,105 terms took 90 % of it, 4,466 killed the process.
     * @param {string} text */
    survives(text) {
        return !this.hasSmallStack || text.split("+=").length < 3300;
    }

    /** Returns a new object of the context. Throws DeviceError where the driver refuses to make one.
     * @template T @param {T | null} object */
    made(object) {
        if (object) return object;
        throw new DeviceError("The graphics driver is out of memory. Close other tabs, and reload the page.");
    }

    /** Throws DeviceError if the device cannot hold `height` rows of weights. @param {number} height */
    check(height) {
        if (this.lost) return;
        const gl = this.gl, side = gl.getParameter(gl.MAX_TEXTURE_SIZE);
        if (Math.max(TEXTURE_WIDTH, height) > side) {
            throw new DeviceError(
                `The weights need a texture of ${TEXTURE_WIDTH} x ${height}; `
                    + `this device's largest side is ${side}.`,
            );
        }
    }

    /** Starts to compile a fragment shader, in the background where the browser supports it. vertex: by default a
     * triangle that covers all. Returns what isReady and finish take.
     * @param {string} fragment */
    begin(fragment, vertex = VERTEX) {
        const gl = this.gl, program = this.made(gl.createProgram());
        const shaders = /** @type {[number, string][]} */ (
            [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]
        ).map(([kind, text]) => {
            const shader = this.made(gl.createShader(kind));
            gl.shaderSource(shader, text);
            gl.compileShader(shader);
            gl.attachShader(program, shader);
            return shader;
        });
        gl.linkProgram(program);
        // Without the extension, a query would wait for the compiler; a fence does not.
        const sync = this.parallel ? null : this.made(gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0));
        gl.flush();
        return {program, shaders, sync};
    }

    /** Whether the compiler has finished, or the context is lost.
     * @param {{program: WebGLProgram, sync: WebGLSync | null}} compilation */
    isReady({program, sync}) {
        const {gl} = this;
        if (this.lost) return true;
        return sync ?
            gl.getSyncParameter(sync, gl.SYNC_STATUS) === gl.SIGNALED
            : this.parallel && gl.getProgramParameter(program, this.parallel.COMPLETION_STATUS_KHR);
    }

    // Whether a slow compilation blocks nothing else; only Direct3D's compiler is slow.
    get patient() {
        return Boolean(this.parallel) || !/direct3d|d3d/i.test(this.name);
    }

    /** Returns the program of a compilation. Throws DeviceError with the first line of the compiler's log.
     * @param {{program: WebGLProgram, shaders: WebGLShader[]}} compilation @returns {Program} */
    finish({program, shaders}) {
        const gl = this.gl;
        if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !this.lost) {
            const log = shaders.map((shader) => gl.getShaderInfoLog(shader)).join("\n") + gl.getProgramInfoLog(program);
            const line = log.split("\n").find((text) => text.trim()) ?? "no reason given";
            gl.deleteProgram(program);
            throw new DeviceError(
                `This device's compiler refuses the shader: ${line.trim().slice(0, 200)}. `
                    + "Try another browser.",
            );
        }
        shaders.forEach((shader) => gl.deleteShader(shader));
        const names = /** @type {Program["names"]} */ ({});
        const count = this.lost ? 0 : gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
        for (let i = 0; i < count; ++i) {
            const {name} = /** @type {WebGLActiveInfo} */ (gl.getActiveUniform(program, i));
            names[name.replace("[0]", "")] = gl.getUniformLocation(program, name);
        }
        return {program, names};
    }

    /** Returns a texture of width x height texels. values: four numbers per texel.
     * @param {number} format @param {number} width @param {number} height @param {number} filter
     * @param {Float32Array | null} values */
    texture(format, width, height, filter, values = null) {
        const gl = this.gl, texture = this.made(gl.createTexture());
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
        if (values) this.write(texture, width, values);
        const set = (/** @type {number} */ name, /** @type {number} */ value) =>
            gl.texParameteri(gl.TEXTURE_2D, name, value);
        for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) set(name, filter);
        for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) set(name, gl.CLAMP_TO_EDGE);
        return texture;
    }

    /** Writes all texels of a texture. values: see texture().
     * @param {WebGLTexture} texture @param {number} width @param {Float32Array} values */
    write(texture, width, values) {
        const gl = this.gl;
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, values.length / 4 / width, gl.RGBA, gl.FLOAT, values);
    }

    /** Returns a texture for a grid of count ** 3 bytes. @param {number} count */
    grid(count) {
        const gl = this.gl, texture = this.made(gl.createTexture());
        gl.bindTexture(gl.TEXTURE_3D, texture);
        gl.texStorage3D(gl.TEXTURE_3D, 1, gl.R8UI, count, count, count);
        for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
            gl.texParameteri(gl.TEXTURE_3D, name, gl.NEAREST);
        return texture;
    }

    /** Uploads a grid. @param {WebGLTexture} texture @param {number} count @param {Uint8Array} values */
    fill(texture, count, values) {
        const gl = this.gl;
        gl.bindTexture(gl.TEXTURE_3D, texture);
        gl.texSubImage3D(gl.TEXTURE_3D, 0, 0, 0, 0, count, count, count, gl.RED_INTEGER, gl.UNSIGNED_BYTE, values);
    }

    /** @param {number} format @param {number} width @param {number} height @param {number} filter @returns {Target} */
    target(format, width, height, filter) {
        const gl = this.gl, texture = this.texture(format, width, height, filter);
        const framebuffer = this.made(gl.createFramebuffer());
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
        return {texture, framebuffer, width, height};
    }

    /** @param {Target} target */
    release({texture, framebuffer}) {
        this.gl.deleteFramebuffer(framebuffer);
        this.gl.deleteTexture(texture);
    }

    // Resolves when all draws have finished, without blocking the page. Throws ContextLost.
    async done() {
        const gl = this.gl, sync = /** @type {WebGLSync} */ (gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0));
        gl.flush();
        while (!this.lost && gl.getSyncParameter(sync, gl.SYNC_STATUS) !== gl.SIGNALED) await pause(1);
        if (this.lost) throw new ContextLost();
        gl.deleteSync(sync);
    }

    /** Returns the result of the promise `work`, and ignores errors of a lost context, which recovery.js reports.
     * @template T @param {Promise<T>} work */
    async unlessLost(work) {
        try {
            return await work;
        } catch (error) {
            if (!(error instanceof ContextLost) && !this.lost) throw error;
        }
    }
}

/** Calls back whenever a CSS pixel has another number of device pixels: on another screen, or zoomed.
 * @param {() => void} onChange */
export function watchDensity(onChange) {
    matchMedia(`(resolution: ${devicePixelRatio}dppx)`).addEventListener("change", () => {
        watchDensity(onChange);
        onChange();
    }, {once: true});
}

export const nextFrame = () => new Promise((resolve) => requestAnimationFrame(resolve));

/** Returns the name of the driver, if the browser reveals it. @param {WebGL2RenderingContext} gl */
function driverName(gl) {
    const plain = String(gl.getParameter(gl.RENDERER));
    if (plain !== "WebKit WebGL") return plain;
    const info = gl.getExtension("WEBGL_debug_renderer_info");
    return info ? String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : plain;
}
