import {copyText} from "./controls.js";
import {say} from "./messages.js";
import {addressOfView} from "./view.js";

// Shares the address of the page with its present view, and copies a frame with it for another page.
const isTouched = () => matchMedia("(pointer: coarse)").matches;

// Returns the address; says what to do where the page has none.
function addressHere() {
    if (/^https?:/.test(location.protocol)) return addressOfView();
    say("This page is a file, without an address. Put it on a web server, open it there, and press this button again.");
}

export async function shareView() {
    const url = addressHere(), {title} = document;
    if (!url) return;
    if (navigator.share && isTouched()) return navigator.share({title, url}).catch(() => {}); // the visitor changed their mind
    await copyText(url);
    say("Copied: the address of this view.");
}

export async function copyFrame() {
    const url = addressHere(), quoted = (text) => `"${text.replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`)}"`;
    if (!url) return;
    await copyText(`<iframe src=${quoted(url)} title=${quoted(document.title)} width="640" height="480" `
        + 'style="border: 0" allow="fullscreen" loading="lazy"></iframe>');
    say("Copied: an <iframe> with this view. Paste it into the HTML of another page.");
}
