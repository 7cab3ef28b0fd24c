import {gpuKernel} from "./gpu_kernel.js";

// The steps of a stage on a GPU, where there is one that is faster than the workers.
const TRIED = 20; // steps that both take at the start, with the same samples
const AGREEMENT = 1e-3; // of their losses, relative

// Returns {all, end}: `all` of the team for a stage's steps. The team takes them while the GPU's kernel compiles, which
// takes seconds with some drivers. The GPU takes them after TRIED more; where it is slower, wrong or lost, or there is
// none, the team takes them. end: frees the GPU.
// source: text of kernel/step.wgsl, or undefined for no GPU; network: of the stage; part: a worker's samples on the
// surface, and as many off it; isForced: waits for the kernel, and uses a software or a slower GPU, too, for tests.
export async function stepperOf(team, source, network, part, isForced) {
    let kernel = null, isEnded = false, tried = 0, fastest = Infinity, spent = 0, next = null;
    const end = () => {
        isEnded = true;
        kernel?.destroy();
        kernel = null;
    };
    const elseEnd = (work) => work().catch(end); // without the GPU
    const samples = (isNew) => team.all("samples", () => ({isNew}));
    const batch = {count: 2 * part * team.workers.length, share: 2 * part, on: part};
    const compiled = elseEnd(async () => {
        kernel = source ? await gpuKernel(source, network, batch, isForced) : null;
        if (isEnded) end();
    });
    if (isForced) await compiled;

    // Lets the GPU take the team's step, too.
    async function compare(answers, question) {
        const taken = await samples(false), loss = answers.reduce((sum, answer) => sum + answer.loss, 0);
        const began = performance.now(), own = await kernel.step(taken, question);
        if (tried++) spent += performance.now() - began; // the first step is slow
        const isFaster = isForced || spent < TRIED * fastest;
        if (!(isFaster && Math.abs(own.loss - loss) <= AGREEMENT * loss)) end();
    }
    async function alone(question) {
        const drawn = await (next ?? samples(true));
        next = samples(true);
        return [await kernel.step(drawn, question)];
    }
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
