import {TrainingError} from "../kernel/training_error.js";

/** @import {Answers} from "../stage/worker.js" */

/** @template {keyof Answers} K @typedef {Parameters<Answers[K]>[0]} Question */
/** @template {keyof Answers} K @typedef {Promise<Awaited<ReturnType<Answers[K]>>>} Answer */

/** The workers of a training. In a page from a file they share no memory, so each has the shape and its own samples. */
export class Team {
    /** @param {string} source text of the workers' script @param {number} size */
    constructor(source, size) {
        this.url = URL.createObjectURL(new Blob([source], {type: "text/javascript"}));
        this.asked = 0;
        /** @type {Error | null} */
        this.failure = null;
        /** @type {Map<number, {resolve: (answer: any) => void, reject: (error: Error) => void}>} */
        this.waiting = new Map();
        this.workers = Array.from({length: size}, () => this.hire(new Worker(this.url)));
    }

    /** @param {Worker} worker */
    hire(worker) {
        worker.onmessage = ({data: {id, answer, error, isExpected}}) => {
            const asked = this.waiting.get(id);
            this.waiting.delete(id); // after a failure, it is not there
            if (error) asked?.reject(new (isExpected ? TrainingError : Error)(error));
            else asked?.resolve(answer);
        };
        worker.onerror = (event) => {
            this.failure = new Error(event.message || "a worker of the training does not start");
            for (const {reject} of this.waiting.values()) reject(this.failure);
            this.waiting.clear();
        };
        return worker;
    }

    /** Asks all workers. Returns their answers.
     * @template {keyof Answers} K @param {K} name @param {(worker: number) => Question<K>} data
     * @returns {Promise<Awaited<Answer<K>>[]>} */
    all(name, data) {
        return Promise.all(this.workers.map((_, i) => this.ask(i, name, data(i))));
    }

    /** Asks one worker, and returns its answer.
     * @template {keyof Answers} K @param {number} worker @param {K} name @param {Question<K>} data
     * @returns {Answer<K>} */
    ask(worker, name, data) {
        return new Promise((resolve, reject) => {
            if (this.failure) throw this.failure;
            const id = ++this.asked;
            this.waiting.set(id, {resolve, reject});
            this.workers[worker].postMessage({id, name, data});
        });
    }

    /** Dismisses all but the first `count` workers. @param {number} count */
    shrink(count) {
        for (const worker of this.workers.splice(count)) worker.terminate();
    }

    dismiss() {
        for (const worker of this.workers) worker.terminate();
        URL.revokeObjectURL(this.url);
    }
}
