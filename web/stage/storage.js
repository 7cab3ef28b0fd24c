/** @import {FileShape, Result, StageShape} from "./state.js" */
/** @typedef {FileShape & Pick<StageShape, "read"> & Pick<Result, keyof Trained | "settings" | "seconds">} Kept */

// One record in the browser's storage, which a reload offers. A browser may refuse storage, above all to pages from
// files: then nothing is kept, and kept() is null. No function throws.
const DATABASE = "mplicits-studio", STORE = "records", KEY = "last";
const MOST_BYTES = 100e6;

/** Keeps a record in place of the one before. Resolves to whether it is kept.
 * @param {Kept} record JSON values and typed arrays */
export async function keep(record) {
    try {
        if (bytesIn(record) > MOST_BYTES) return false;
        await inStore("readwrite", (store) => store.put(record, KEY));
        return true;
    } catch {
        return false;
    }
}

/** Resolves to the record, or null. @returns {Promise<Kept | null>} */
export async function kept() {
    try {
        return await inStore("readonly", (store) => store.get(KEY)) ?? null;
    } catch {
        return null;
    }
}

export async function forget() {
    try {
        await inStore("readwrite", (store) => store.delete(KEY));
    } catch { /* there is no storage, so there is no record */ }
}

/** Resolves to the result of a request in a transaction, when that is complete.
 * @template T @param {IDBTransactionMode} mode @param {(store: IDBObjectStore) => IDBRequest<T>} request */
async function inStore(mode, request) {
    const opening = indexedDB.open(DATABASE, 1);
    opening.onupgradeneeded = () => opening.result.createObjectStore(STORE);
    /** @type {IDBDatabase} */
    const database = await new Promise((resolve, reject) => {
        opening.onsuccess = () => resolve(opening.result);
        opening.onerror = opening.onblocked = () => reject(opening.error);
    });
    try {
        const transaction = database.transaction(STORE, mode), asked = request(transaction.objectStore(STORE));
        await new Promise((resolve, reject) => {
            transaction.oncomplete = resolve;
            transaction.onerror = transaction.onabort = () => reject(transaction.error);
        });
        return asked.result;
    } finally {
        database.close();
    }
}

/** @param {unknown} value @returns {number} */
function bytesIn(value) {
    if (ArrayBuffer.isView(value) || value instanceof ArrayBuffer) return value.byteLength;
    if (typeof value === "string") return 2 * value.length;
    return value && typeof value === "object" ? Object.values(value).reduce((sum, part) => sum + bytesIn(part), 0) : 8;
}
