import {gpuKernel} from "./gpu_kernel.js";
/** @import {StepAnswer, StepQuestion, Stepper} from "./optimize.js" */
/** @import {Team} from "./workers.js" */
/** @typedef {NonNullable<Awaited<ReturnType<typeof gpuKernel>>>} GpuKernel */

// The steps of a stage on a GPU, where there is one that is faster than the workers.
const TRIED = 20; // steps that both take at the start, with the same samples
const AGREEMENT = 1e-3; // of their losses, relative

/** Returns what takes a stage's steps. The team takes them while the GPU's kernel compiles, which takes seconds with
 * some drivers. The GPU takes them after TRIED more; where it is slower, wrong or lost, or there is none, the team
 * takes them. end: frees the GPU. isForced: waits for the kernel, and uses a software or a slower GPU, too, for tests.
 * @param {Team} team @param {string | undefined} source text of kernel/step.wgsl @param {KernelNetwork} network
 * @param {number} part a worker's samples on the surface, and as many off it @param {boolean} [isForced]
 * @returns {Promise<Stepper & {end: () => void}>} */
export async function stepperOf(team, source, network, part, isForced) {
    let isEnded = false, tried = 0, fastest = Infinity, spent = 0;
    /** @type {GpuKernel | null} */
    let kernel = null;
    /** @type {Promise<Float32Array[]> | null} */
    let next = null;
    const end = () => {
        isEnded = true;
        kernel?.destroy();
        kernel = null;
    };
    /** Goes on without the GPU after an error. @template T @param {() => Promise<T>} work */
    const elseEnd = (work) => work().catch(end);
    const samples = (/** @type {boolean} */ isNew) => team.all("samples", () => ({isNew}));
    const batch = {count: 2 * part * team.workers.length, share: 2 * part, on: part};
    const compiled = elseEnd(async () => {
        kernel = source ? await gpuKernel(source, network, batch, isForced) : null;
        if (isEnded) end();
    });
    if (isForced) await compiled;

    /** Lets the GPU take the team's step, too. @param {StepAnswer[]} answers @param {StepQuestion} question */
    async function compare(answers, question) {
        const taken = await samples(false), loss = answers.reduce((sum, answer) => sum + answer.loss, 0);
        const began = performance.now(), own = await /** @type {GpuKernel} */ (kernel).step(taken, question);
        if (tried++) spent += performance.now() - began; // the first step is slow
        const isFaster = isForced || spent < TRIED * fastest;
        if (!(isFaster && Math.abs(own.loss - loss) <= AGREEMENT * loss)) end();
    }
    /** @param {StepQuestion} question */
    async function alone(question) {
        const drawn = await (next ?? samples(true));
        next = samples(true);
        return [await /** @type {GpuKernel} */ (kernel).step(drawn, question)];
    }
    /** @type {Stepper["all"]} */
    async function all(name, question) {
        const answer = kernel && tried === TRIED ? await elseEnd(() => alone(question())) : null;
        if (answer) return answer;
        const began = performance.now(), answers = await team.all(name, question);
        fastest = Math.min(fastest, performance.now() - began);
        if (kernel) await elseEnd(() => compare(answers, question()));
        return answers;
    }
    return {all, end};
}
