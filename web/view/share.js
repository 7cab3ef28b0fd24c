import {copyText} from "./controls.js";
import {say} from "./messages.js";

/** Shares the address of the page, whose hash is the view; or copies a frame with it for another page.
 * @param {boolean} isFrame */
export async function share(isFrame) {
    const {href: url, protocol} = location, {title} = document, isFinger = matchMedia("(pointer: coarse)").matches;
    if (!/^http/.test(protocol))
        return say("A file has no address: put this page on a web server, and share it there.");
    if (!isFrame && isFinger && navigator.share) return navigator.share({title, url}).catch(() => {}); // closed
    const escaped = (/** @type {string} */ text) => text.replaceAll("&", "&amp;").replaceAll('"', "&quot;");
    await copyText(
        isFrame ?
            `<iframe src="${escaped(url)}" title="${escaped(title)}" width="640" height="480" `
            + 'allow="fullscreen" loading="lazy"></iframe>' :
            url,
    );
    say(`Copied: ${isFrame ? "a frame for the HTML of another page" : "the address of this view"}.`);
}
