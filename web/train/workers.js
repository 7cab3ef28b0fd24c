import {TrainingError} from "../kernel/training_error.js";

// The workers of a training. In a page from a file they share no memory, so each has the shape and its own samples.
export class Team {
    // source: text of the workers' script.
    constructor(source, size) {
        Object.assign(this, {
            url: URL.createObjectURL(new Blob([source], {type: "text/javascript"})),
            asked: 0,
            failure: null,
        });
        this.waiting = new Map();
        this.workers = Array.from({length: size}, () => this.hire(new Worker(this.url)));
    }

    hire(worker) {
        worker.onmessage = ({data: {id, answer, error, isExpected}}) => {
            const {resolve, reject} = this.waiting.get(id) ?? {};
            if (!this.waiting.delete(id)) return; // after a failure
            if (error) reject(new (isExpected ? TrainingError : Error)(error));
            else resolve(answer);
        };
        worker.onerror = (event) => {
            this.failure = new Error(event.message || "a worker of the training does not start");
            for (const {reject} of this.waiting.values()) reject(this.failure);
            this.waiting.clear();
        };
        return worker;
    }

    // Asks all workers. data: returns the question of the i-th one. Returns their answers.
    all(name, data) {
        return Promise.all(this.workers.map((_, i) => this.ask(i, name, data(i))));
    }

    // Asks one worker, and returns its answer.
    ask(worker, name, data) {
        return new Promise((resolve, reject) => {
            if (this.failure) throw this.failure;
            const id = ++this.asked;
            this.waiting.set(id, {resolve, reject});
            this.workers[worker].postMessage({id, name, data});
        });
    }

    // Dismisses all but the first `count` workers.
    shrink(count) {
        for (const worker of this.workers.splice(count)) worker.terminate();
    }

    dismiss() {
        for (const worker of this.workers) worker.terminate();
        URL.revokeObjectURL(this.url);
    }
}
