import {gpuDevice, gpuKernel} from "./gpu_kernel.js";

// The steps of a stage on a GPU, where there is one that is faster than the workers.
const TRIED = 20; // steps that both take at the start, with the same samples
const AGREEMENT = 1e-3; // of their losses, relative

// Returns {all, end}: `all` of the team for a stage's steps. A GPU takes them after TRIED steps; where it is slower,
// wrong or lost, or there is none, the team takes them. end: frees the GPU.
// source: text of kernel/step.wgsl, or undefined for no GPU; network: of the stage; part: samples on the surface, and as
// many off it, of a worker; isForced: uses a software or a slower GPU, too, for tests.
export async function stepperOf(team, source, network, part, isForced) {
    let device = null, kernel = null, tried = 0, fastest = Infinity, spent = 0, next = null;
    const end = () => {
        device?.destroy();
        device = kernel = null;
    };
    try {
        device = source ? await gpuDevice(isForced) : null;
        const batch = {count: 2 * part * team.workers.length, share: 2 * part, on: part};
        kernel = device && await gpuKernel(device, source, network, batch);
    } catch {
        end();
    }

    // Lets the GPU take the team's step, too.
    async function compare({loss}, question) {
        const samples = await team.all("samples", () => ({isNew: false})), began = performance.now();
        const own = await kernel(samples, question);
        if (tried++) spent += performance.now() - began; // the first step is slow
        const isSlower = tried > 1 && spent > TRIED * fastest;
        if (!(Math.abs(own.loss - loss) <= AGREEMENT * loss) || (isSlower && !isForced)) end();
    }

    return {
        end,
        async all(name, question) {
            try {
                if (kernel && tried === TRIED) {
                    const samples = await (next ?? team.all("samples", () => ({isNew: true})));
                    next = team.all("samples", () => ({isNew: true}));
                    return [await kernel(samples, question())];
                }
            } catch {
                end();
            }
            const began = performance.now(), answers = await team.all(name, question);
            fastest = Math.min(fastest, performance.now() - began);
            try {
                if (kernel) await compare({loss: answers.reduce((sum, {loss}) => sum + loss, 0)}, question());
            } catch {
                end();
            }
            return answers;
        },
    };
}
