// 1,000 characters are 869 bytes of a raw deflate stream (web/base124.py). It holds the page's HTML, a zero byte, and the
// page's parts, for which marks stand in the HTML (Parts of web/document.py).
(async () => {
    const outer = document.documentElement.outerHTML, packed = document.getElementById("packed").textContent;
    const hex = packed.replace(/[^]{1,1000}/g, (group) => {
        let value = 0n;
        for (let k = 0; k < group.length; ++k) {
            const code = group.charCodeAt(k);
            value = 124n * value + BigInt(code - 1 - /** @type {any} */ (code > 13) - /** @type {any} */ (code > 60));
        }
        return value.toString(16).padStart(2 * Math.floor(group.length * 869 / 1000), "0");
    });
    const data = Uint8Array.from(hex.match(/../g) ?? [], (digits) => parseInt(digits, 16));
    const stream = new Blob([data]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    const all = new Uint8Array(await new Response(stream).arrayBuffer());
    const end = all.indexOf(0),
        text = (/** @type {Uint8Array} */ bytes) => new TextDecoder().decode(bytes),
        html = text(all.subarray(0, end));
    const base64 = (/** @type {Uint8Array} */ bytes) => btoa(Array.from(bytes, (c) => String.fromCharCode(c)).join(""));
    const parts = all.subarray(end + 1), poster = document.getElementById("poster").src;
    globalThis.packedPage = {outer, html};
    document.open();
    document.write(html.replace(/\x01(.)(\d*),?(\d*)\x01/g, (_, letter, at, count) => (
        letter === "p" ? poster : (letter === "t" ? text : base64)(parts.subarray(at, Number(at) + Number(count)))
    )));
    document.close();
})().catch(() => {
    document.getElementById("note").textContent = globalThis.DecompressionStream
        ? "This file is damaged; copy or download it again."
        : "This browser is too old for this page. Try a current Firefox, Chrome, Edge or Safari.";
});
