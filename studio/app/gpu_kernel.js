import {FACTORS, parameterCount, SAMPLE} from "./kernel.js";

// A network in the WebGPU kernel (kernel/step.wgsl).
const POINTS = 32, THREADS = 64; // of a tile; of `reduce`
const UNIFORM_BYTES = 48;

// Returns a WebGPU device, or null where there is none, or only one in software. isForced: accepts that one, too.
export async function gpuDevice(isForced) {
    const adapter = await navigator.gpu?.requestAdapter({powerPreference: "high-performance"});
    const isSlow = !adapter || (adapter.info?.isFallbackAdapter && !isForced);
    return isSlow ? null : adapter.requestDevice();
}

// Returns a function of samples and {weights, factors} that takes a step: {gradient, loss, meanF}, as the workers' step.
// Its samples are arrays of `share`, in all `count`; the first `on` of each lie on the surface. source: the kernel's text.
export async function gpuKernel(device, source, network, {count, share, on}) {
    const {width, depth, outputs} = network, parameters = parameterCount(network);
    const padded = 4 * Math.ceil(parameters / 4), sums = padded + 4; // floats
    const rows = (4 * depth + 10) * width * POINTS, limit = device.limits.maxStorageBufferBindingSize / 4;
    const groups = Math.min(count / POINTS, Math.floor(limit / Math.max(rows, sums)));
    const {UNIFORM, STORAGE, COPY_DST, COPY_SRC, MAP_READ} = GPUBufferUsage;
    const buffer = (floats, usage) => device.createBuffer({size: 4 * floats, usage});
    const buffers = [
        buffer(UNIFORM_BYTES / 4, UNIFORM | COPY_DST), buffer(SAMPLE * count, STORAGE | COPY_DST),
        buffer(padded, STORAGE | COPY_DST), buffer(rows * groups, STORAGE), buffer(sums * groups, STORAGE),
        buffer(sums, STORAGE | COPY_SRC),
    ];
    const result = buffer(sums, MAP_READ | COPY_DST);
    const kinds = ["uniform", "read-only-storage", "read-only-storage", "storage", "storage", "storage"];
    const bindings = device.createBindGroupLayout({entries: kinds.map((type, binding) => (
        {binding, visibility: GPUShaderStage.COMPUTE, buffer: {type}}))});
    const bound = device.createBindGroup({layout: bindings, entries: buffers.map((own, binding) => (
        {binding, resource: {buffer: own}}))});
    const layout = device.createPipelineLayout({bindGroupLayouts: [bindings]});
    const constants = `const WIDTH = ${width}u; const DEPTH = ${depth}u; const OUTPUTS = ${outputs}u;\n`;
    const module = device.createShaderModule({code: constants + source});
    const [step, reduce] = await Promise.all(["step", "reduce"].map((entryPoint) => (
        device.createComputePipelineAsync({layout, compute: {module, entryPoint}}))));
    const uniform = new Float32Array(UNIFORM_BYTES / 4);
    new Uint32Array(uniform.buffer).set([count, share, on], FACTORS.length + 1);
    const lost = device.lost.then(({message}) => { throw new Error(message); });
    lost.catch(() => {});
    return async (samples, {weights, factors}) => {
        uniform.set([...FACTORS, "smoothness"].map((name) => factors[name] ?? 0));
        device.queue.writeBuffer(buffers[0], 0, uniform);
        samples.forEach((part, k) => device.queue.writeBuffer(buffers[1], k * part.byteLength, part));
        device.queue.writeBuffer(buffers[2], 0, weights);
        const encoder = device.createCommandEncoder(), pass = encoder.beginComputePass();
        pass.setBindGroup(0, bound);
        pass.setPipeline(step);
        pass.dispatchWorkgroups(groups);
        pass.setPipeline(reduce);
        pass.dispatchWorkgroups(Math.ceil(sums / 4 / THREADS));
        pass.end();
        encoder.copyBufferToBuffer(buffers[5], 0, result, 0, 4 * sums);
        device.queue.submit([encoder.finish()]);
        await Promise.race([result.mapAsync(GPUMapMode.READ), lost]);
        const floats = new Float32Array(result.getMappedRange().slice(0));
        result.unmap();
        return {gradient: floats.subarray(0, parameters), loss: floats[padded], meanF: floats[padded + 1]};
    };
}
