// Remembers which variant of a model was the faster one in an earlier visit: "literal" or "texture"; "trying" where the
// trial was never finished; null where there was none. hash: the model's, a part of the key.
export function memoryOf(hash) {
    const key = `mplicits ${hash}`;
    let last = null;
    return {
        read() {
            try {
                return localStorage.getItem(key);
            } catch {
                return last;
            }
        },
        write(storage) {
            last = storage;
            try {
                if (storage) localStorage.setItem(key, storage);
                else localStorage.removeItem(key);
            } catch { /* a browser that keeps nothing */ }
        },
        // Writes what is to be remembered of a trial that something else ended.
        interrupted(storage) {
            if (this.read() === "trying") this.write(storage);
        },
    };
}
