// Remembers which variant of a model was the faster one in an earlier visit: "literal" or "texture"; "trying" where the
// trial was never finished; null where there was none. And, while the tab is open, how many of the model's levels the
// driver may be able to draw, Infinity for all. hash: the model's, a part of the key; empty: it is not to be kept.
export function memoryOf(hash) {
    const key = `mplicits ${hash}`;
    let last = null, levels = Infinity;
    return {
        get levels() {
            try {
                return Number(hash && sessionStorage.getItem(`${key} levels`)) || levels;
            } catch {
                return levels;
            }
        },
        set levels(count) {
            levels = count;
            try {
                if (hash) sessionStorage.setItem(`${key} levels`, count);
            } catch { /* a browser that keeps nothing */ }
        },
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
