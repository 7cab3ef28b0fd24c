// Which variant of a model an earlier visit found to be the faster one: "literal" or "texture"; "trying" where it never
// came to an answer; null where none was sought.
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
        // What is to be remembered of a trial that something else ends.
        interrupted(storage) {
            if (this.read() === "trying") this.write(storage);
        },
    };
}
