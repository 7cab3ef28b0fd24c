const MOST = 1000; // files

/** Resolves to the files of a drop, those in folders too; path: from the dropped folder on.
 * @param {DataTransfer} transfer of a drop event, and only during it
 * @returns {Promise<(File & {path?: string})[]>} */
export async function filesOfDrop(transfer) {
    const entries = [...transfer.items].flatMap((item) => item.webkitGetAsEntry?.() ?? []);
    if (!entries.some(({isDirectory}) => isDirectory)) return [...transfer.files];
    const files = [], pending = entries;
    /** @template T @param {(yes: (value: T) => void, no: (error: DOMException) => void) => void} ask
     * @returns {Promise<T>} */
    const asked = (ask) => new Promise(ask);
    while (pending.length && files.length < MOST) {
        const entry = /** @type {FileSystemFileEntry & FileSystemDirectoryEntry} */ (pending.shift());
        if (entry.isFile) {
            const file = await asked(entry.file.bind(entry));
            files.push(Object.assign(file, {path: entry.fullPath}));
            continue;
        }
        const reader = entry.createReader(); // hands out some entries at a time, and none at the end
        for (let isMore = true; isMore && pending.length < MOST;) {
            const some = await asked(reader.readEntries.bind(reader));
            isMore = some.length > 0;
            pending.push(...some);
        }
    }
    return files;
}
