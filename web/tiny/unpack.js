// Unpacks a tiny page: text of base 124 (web/base124.py), a deflate stream. It holds a script, a zero byte, and weights,
// which the script finds in `packed`. `stop` replaces the page by a line that says why there is no picture. What is cast to
// any, JavaScript converts by itself, which takes fewer bytes.
(async () => {
    const [script] = document.scripts,
        hex = script.text.replace(/[^]{1,1000}/g, (group) => {
            let value = 0n;
            for (const letter of group) {
                const code = /** @type {any} */ (letter).charCodeAt();
                value = value * 124n +
                    BigInt(code - 1 - /** @type {any} */ (code > 13) - /** @type {any} */ (code > 60));
            }
            return value.toString(16).padStart(2 * (group.length * .869 | 0), /** @type {any} */ (0));
        });
    const stream = /** @type {ReadableStream} */ (
        new Response(
            Uint8Array.from(/** @type {any} */ (hex.match(/../g)), (digits) => /** @type {any} */ ("0x" + digits)),
        ).body
    ).pipeThrough(new DecompressionStream("deflate-raw"));
    self.packed = new Uint8Array(await new Response(stream).arrayBuffer());
    script.type = "";
    [script.text] = new TextDecoder().decode(packed).split("\0"); // which runs it
})().catch(
    self.stop = /** @param {unknown} [reason] */ (reason) => {
        document.body.style.cssText = "margin:40vh 9px;font:20px system-ui;text-align:center";
        document.body.textContent = `${document.title} cannot be drawn: ${reason}. Try another browser or device.`;
    },
);
