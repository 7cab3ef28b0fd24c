import {FACTORS, parameterCount, SAMPLE} from "../kernel/kernel.js";
/** @import {StepQuestion} from "./optimize.js" */

// A network in the WebGPU kernel (kernel/step.wgsl).
const POINTS = 32; // of a tile
const REDUCED = 256; // vectors of four sums that a pair of work groups reduces

/** Returns null where there is no GPU, or only one in software. isForced: takes that one, too. step: as the workers'
 * step, but takes their samples, too. @param {string} source the kernel's text @param {KernelNetwork} network
 * @param {Record<"count" | "share" | "on", number>} batch of `count` samples: of each `share` of them, the first `on`
 * are on the surface @param {boolean} [isForced] */
export async function gpuKernel(source, {width, depth, outputs}, {count, share, on}, isForced) {
    const adapter = await navigator.gpu?.requestAdapter({powerPreference: "high-performance"});
    if (!adapter || (adapter.info?.isFallbackAdapter && !isForced)) return null;
    const device = await adapter.requestDevice(), {queue} = device;
    const lost = device.lost.then(({message}) => {
        throw new Error(message);
    });
    lost.catch(() => {});
    const code = `const WIDTH = ${width}u; const DEPTH = ${depth}u; const OUTPUTS = ${outputs}u;\n${source}`;
    const compute = {module: device.createShaderModule({code}), entryPoint: "step"};
    const pipeline = await device.createComputePipelineAsync({layout: "auto", compute});
    const parameters = parameterCount({width, depth, outputs});
    const padded = 4 * Math.ceil(parameters / 4), sums = padded + 4, rows = (4 * depth + 10) * width * POINTS; // floats
    const most = device.limits.maxStorageBufferBindingSize / 4 / Math.max(rows, sums);
    const groups = Math.min(count / POINTS, Math.floor(most));
    const {UNIFORM, STORAGE, COPY_DST, COPY_SRC, MAP_READ} = GPUBufferUsage;
    const uniform = new Float32Array(FACTORS.length + 4);
    new Uint32Array(uniform.buffer).set([count, share, on], FACTORS.length + 1);
    /** @param {number} size of floats @param {number} usage */
    const buffer = (size, usage) => device.createBuffer({size: 4 * size, usage});
    const input = (/** @type {number} */ size, usage = STORAGE) => buffer(size, usage | COPY_DST);
    const buffers = [
        input(uniform.length, UNIFORM),
        input(SAMPLE * count),
        input(padded),
        buffer(rows * groups, STORAGE),
        buffer(sums * groups, STORAGE),
        buffer(sums, STORAGE | COPY_SRC),
    ];
    const result = input(sums, MAP_READ), entries = buffers.map((own, binding) => ({binding, resource: {buffer: own}}));
    const bound = device.createBindGroup({layout: pipeline.getBindGroupLayout(0), entries});
    /** @param {Float32Array[]} samples @param {StepQuestion} question */
    const step = async (samples, {weights, factors}) => {
        uniform.set([...FACTORS, "smoothness"].map((name) => factors[name] ?? 0));
        queue.writeBuffer(buffers[0], 0, uniform);
        samples.forEach((part, k) => queue.writeBuffer(buffers[1], k * part.byteLength, part));
        queue.writeBuffer(buffers[2], 0, weights);
        const encoder = device.createCommandEncoder(), pass = encoder.beginComputePass();
        pass.setPipeline(pipeline);
        pass.setBindGroup(0, bound);
        pass.dispatchWorkgroups(groups);
        pass.dispatchWorkgroups(Math.ceil(sums / 4 / REDUCED), 2);
        pass.end();
        encoder.copyBufferToBuffer(buffers[5], 0, result, 0, 4 * sums);
        queue.submit([encoder.finish()]);
        await Promise.race([result.mapAsync(GPUMapMode.READ), lost]);
        const floats = new Float32Array(result.getMappedRange().slice(0));
        result.unmap();
        return {gradient: floats.subarray(0, parameters), loss: floats[padded], meanF: floats[padded + 1]};
    };
    return {step, destroy: () => device.destroy()};
}
