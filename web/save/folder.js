// Lists the files of a drop, those in folders too.
const MOST = 1000; // files

// transfer: of a drop event, and only during it. Resolves to File objects with `path`, from the dropped folder on.
export async function filesOfDrop(transfer) {
    const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
    if (!entries.some(({isDirectory}) => isDirectory)) return [...transfer.files];
    const files = [], pending = entries, asked = (ask) => new Promise(ask);
    while (pending.length && files.length < MOST) {
        const entry = pending.shift();
        if (entry.isFile) {
            files.push(Object.assign(await asked((yes, no) => entry.file(yes, no)), {path: entry.fullPath}));
            continue;
        }
        const reader = entry.createReader(); // hands out some entries at a time, and none at the end
        for (let some = [0]; some.length && pending.length < MOST;) {
            some = await asked((yes, no) => reader.readEntries(yes, no));
            pending.push(...some);
        }
    }
    return files;
}
