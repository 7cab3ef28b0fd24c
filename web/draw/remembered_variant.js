/** Returns the memory of a model, found by its hash. read() returns the faster variant of the last visit, "literal"
 * or "texture"; "trying" after an unfinished trial; or null. `levels` is the number of levels that the driver can
 * draw, Infinity for all; it lasts until the tab closes. With an empty hash, the memory ends with the page.
 * @param {string} hash */
export function memoryOf(hash) {
    const key = `mplicits ${hash}`;
    /** @type {string | null} */ let last = null;
    let levels = Infinity;
    /** @template T @param {() => T} access @param {T} [fallback] */
    const attempt = (access, fallback) => {
        try {
            return access();
        } catch { // a browser without storage
            return fallback;
        }
    };
    return {
        get levels() {
            return attempt(() => Number(hash && sessionStorage.getItem(`${key} levels`)), 0) || levels;
        },
        set levels(count) {
            levels = count;
            if (hash) attempt(() => sessionStorage.setItem(`${key} levels`, String(count)));
        },
        read: () => attempt(() => localStorage.getItem(key), last),
        /** @param {string | null} storage */
        write(storage) {
            last = storage;
            attempt(() => (storage ? localStorage.setItem(key, storage) : localStorage.removeItem(key)));
        },
        /** Writes the result of a trial that something else ended. @param {string | null} storage */
        interrupted(storage) {
            if (this.read() === "trying") this.write(storage);
        },
    };
}
