"""The stage `page` of on_gpu.py: a model's page and the studio in headless Chromium, by WebGL and by WebGPU."""

import os
import statistics
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path
from typing import Any

from gpu_browser import PACK, Browser, BrowserError, unpack
from stages import Results

REHEARSAL = "MPLICITS_REHEARSAL" in os.environ
"""Whether to run tiny cases on SwiftShader."""
WAYS = {
    "Vulkan": ("--use-angle=vulkan", "--enable-features=Vulkan,DefaultANGLEVulkan", "--disable-vulkan-surface"),
    "OpenGL through EGL": ("--use-angle=gl-egl",),
}
"""Chromium's flags for a GPU of a machine without a display, see chosen_flags().

Sources: Vulkan: developer.chrome.com/blog/supercharge-web-ai-testing; EGL: github.com/remotion-dev/remotion/pull/3041.
"""
SOFTWARE = ("swiftshader", "llvmpipe")
MODELS = ("spot-small", "spot")
SIZES = ((160, 90),) if REHEARSAL else ((1280, 720), (1920, 1080))
WINDOW = (320, 200) if REHEARSAL else (1280, 720)
"""Of the studio."""
TURN, FIRST, TRAINED = (2, 40, 20) if REHEARSAL else (2, 12, 30)
"""Seconds: of a turntable that is measured, at most until the first picture is refined, of a training in the studio."""
WHAT = """(async () => {
    const gl = document.createElement("canvas").getContext("webgl2"), adapter = await navigator.gpu?.requestAdapter();
    const {vendor, architecture, description, isFallbackAdapter} = adapter?.info ?? {};
    const name = gl?.getExtension("WEBGL_debug_renderer_info")?.UNMASKED_RENDERER_WEBGL;
    const webgpu = adapter && {vendor, architecture, description, isFallbackAdapter};
    return {webgl: gl ? gl.getParameter(name ?? gl.RENDERER) : "none", webgpu: webgpu ?? null};
})()"""
WATCH = """
const watched = globalThis.watched = {drawn: null, still: null, frames: []};
new MutationObserver((records) => {
    const {dataset} = document.documentElement ?? {dataset: {}};
    if ("drawn" in dataset) watched.drawn ??= performance.now();
    if (dataset.state === "still") watched.still ??= performance.now();
    for (const {target, type} of records) {
        const size = type === "childList" && target.id === "status" && /s · (\\d+) × (\\d+)/.exec(target.textContent);
        if (size) watched.frames.push([performance.now(), Number(size[1]), Number(size[2])]);
    }
}).observe(document, {subtree: true, childList: true, attributes: true, attributeFilter: ["data-drawn", "data-state"]});
"""
"""Records when the page first shows a picture, when that is refined, and all frames: milliseconds, width, height."""
STEPS = """
const steps = globalThis.steps = [], {postMessage} = Worker.prototype, {submit} = GPUQueue.prototype;
const {getMappedRange} = GPUBuffer.prototype, heard = new WeakSet(), asked = new Map();
let first = null, step = null;
Worker.prototype.postMessage = function (question, ...more) {
    first ??= this;
    if (this === first && question.name.startsWith("begin")) steps.push(["begin", performance.now(), 0]);
    if (question.name === "step") {
        if (this === first) step = {pending: 0, loss: 0};
        ++step.pending;
        asked.set(question.id, step); // the page's own listener asks for the next step before the one below hears
    }
    if (!heard.has(this)) {
        heard.add(this);
        this.addEventListener("message", ({data: {id, answer}}) => {
            const own = asked.get(id);
            if (!asked.delete(id) || !answer) return;
            own.loss += answer.loss;
            if (!--own.pending) steps.push(["workers", performance.now(), own.loss]);
        });
    }
    return postMessage.call(this, question, ...more);
};
GPUBuffer.prototype.getMappedRange = function (...range) {
    const found = getMappedRange.apply(this, range);
    steps.push(["gpu", performance.now(), new Float32Array(found, found.byteLength - 16, 1)[0]]);
    return found;
};
"""
"""Records all steps of a training: who took it, milliseconds, loss; and the beginnings of its stages."""
NO_WEBGPU = 'Object.defineProperty(Navigator.prototype, "gpu", {get: () => undefined});'
PRETENDED = """
const {getParameter} = WebGL2RenderingContext.prototype;
WebGL2RenderingContext.prototype.getParameter = function (name) {
    return name === this.RENDERER ? "a pretended GPU" : getParameter.call(this, name);
};
Object.defineProperty(GPUAdapterInfo.prototype, "isFallbackAdapter", {get: () => false});
"""
"""Lets the studio take SwiftShader for a GPU."""
ENDED = "Boolean(document.querySelector('#message:not([hidden]), #longer:not([hidden])'))"
SAID = "document.querySelector('#message:not([hidden]) p, .now:not([hidden]) #report')?.textContent ?? ''"
"""The page's message, or else the studio's report."""
TRAIN = """(() => {
    const {elements} = document.getElementById("settings");
    elements.seconds.value = "%d";
    elements.levels.value = "%s";
    document.querySelector("[data-example='0']").click();
})()"""


def page(results: Results) -> None:
    """Measure the pages."""
    scratch = Path(os.environ["MPLICITS_PROGRAMS"], "pages")
    scratch.mkdir(parents=True)
    if not list(PACK.glob("*/part")):
        results.set("missing", f"{PACK} is empty: run benchmarks/pack_browser.py first")
        return
    with ThreadPoolExecutor() as pool:
        baked = pool.map(lambda name: bake(name, scratch), ("", *MODELS)[: 2 if REHEARSAL else None])
        program = unpack(scratch)
    drawn = {"VK_DRIVER_FILES": str(program.parent / "vk_swiftshader_icd.json")} if REHEARSAL else {}
    flags = chosen_flags(program, scratch, drawn, results)
    if flags is None:
        results.add("errors", {"webgl": "no way to the GPU"})
        return
    for path in baked:
        try:
            with Browser(program, flags, scratch / f"{path.stem}-profile", drawn) as browser:
                (studio if path.stem == "studio" else view)(browser, path, results)
        except BrowserError as error:
            results.add("errors", {"page": path.stem, "said": str(error)})


def chosen_flags(program: Path, folder: Path, drawn: dict[str, str], results: Results) -> tuple[str, ...] | None:
    """Return the flags of the first of WAYS that has WebGL and WebGPU on the GPU, or else WebGL alone, or else None."""
    empty, chosen = folder / "empty.html", None  # WebGPU needs a page with an address
    empty.write_text("<!doctype html><title>empty</title>", encoding="utf-8")
    for way, flags in WAYS.items():
        try:
            with Browser(program, ("--use-gl=angle", *flags), folder / way, drawn) as browser:
                browser.open(empty.as_uri(), (300, 200))
                found = browser.value(WHAT)
        except BrowserError as error:
            results.add("tried", {"way": way, "webgl": str(error), "webgpu": None})
            continue
        results.add("tried", {"way": way, **found})
        if REHEARSAL or not any(name in found["webgl"].lower() for name in (*SOFTWARE, "none")):
            chosen = chosen or ("--use-gl=angle", *flags)
            if REHEARSAL or (found["webgpu"] and not found["webgpu"]["isFallbackAdapter"]):
                return ("--use-gl=angle", *flags)
    return chosen


def bake(model: str, folder: Path) -> Path:
    """Write the page of a model, or for an empty name the studio."""
    path = folder / f"{model or 'studio'}.html"
    words = ("bake", model, "--target", "html") if model else ("studio",)
    subprocess.run([sys.executable, "-m", "mplicits", *words, "-o", str(path)], check=True)
    return path


def view(browser: Browser, path: Path, results: Results) -> None:
    """Measure a model's page: seconds to its first picture, and frames of a turntable, coarse and of all pixels."""
    for width, height in SIZES:
        browser.open(f"{path.as_uri()}#panel=0", (width, height), WATCH)
        browser.until("watched.still !== null", FIRST)
        watched = browser.value("watched")
        seconds = {name: watched[name] and round(watched[name] / 1000, 2) for name in ("drawn", "still")}
        entry: dict[str, Any] = {"page": path.stem, "width": width, "height": height, **seconds}
        browser.picture(results.folder / f"{path.stem}-{height}.png")
        browser.call("Page.navigate", url="about:blank")
        browser.open(f"{path.as_uri()}#panel=0&turntable=8", (width, height), WATCH)
        browser.until("watched.drawn !== null", FIRST)
        for resolution in ("auto", "1"):
            browser.value(f"document.querySelector('#resolution [value=\"{resolution}\"]').click()")
            time.sleep(TURN / 2)  # the number of pixels settles
            began = browser.value("(watched.frames = [], performance.now())")
            time.sleep(TURN)
            ended, frames = browser.value("[performance.now(), watched.frames]")
            entry[f"fps_{resolution}"] = round(1000 * len(frames) / (ended - began), 2)
            entry[f"pixels_{resolution}"] = round(statistics.mean(w * h for _, w, h in frames)) if frames else None
        entry["storage"] = browser.value("document.documentElement.dataset.storage ?? null")
        results.add("pages", entry | {"said": browser.value(SAID)})
        browser.picture(results.folder / f"{path.stem}-{height}-turning.png")
        browser.call("Page.navigate", url="about:blank")


def studio(browser: Browser, path: Path, results: Results) -> None:
    """Train an example in the studio, with WebGPU and by the workers alone."""
    for name, script in {"WebGPU": PRETENDED if REHEARSAL else "", "workers": NO_WEBGPU}.items():
        browser.open(path.as_uri(), WINDOW, STEPS + script)
        browser.until("'ready' in document.documentElement.dataset", FIRST)
        browser.value(TRAIN % (TRAINED, "16x1,16x1" if REHEARSAL else ""))
        ended = browser.until(ENDED, 2 * TRAINED + FIRST)
        said = browser.value(SAID)
        stages = stages_of(browser.value("steps"))
        results.add("trainings", {"with": name, "ended": ended, "said": said, "stages": stages})
        browser.until("document.documentElement.dataset.state === 'still'", FIRST)
        browser.picture(results.folder / f"studio-{name}.png")
        browser.call("Page.navigate", url="about:blank")


def stages_of(steps: list[tuple[str, float, float]]) -> list[dict[str, Any]]:
    """Return what happened in each stage of a training, from what STEPS records.

    Each entry: "gpu", "workers": steps; "gpu_ms", "workers_ms": median milliseconds from one to the next while no other
    takes any, or None; "difference": the largest relative one of their losses for the same samples, or None.
    """
    stages: list[list[tuple[str, float, float]]] = []
    for step in steps:
        if step[0] == "begin":
            stages.append([])
        else:
            stages[-1].append(step)
    entries = []
    for stage in stages:
        entry: dict[str, Any] = {}
        for name in ("gpu", "workers"):
            spans = [b[1] - a[1] for a, b in pairwise(stage) if a[0] == b[0] == name]
            entry[name] = sum(step[0] == name for step in stage)
            entry[f"{name}_ms"] = round(statistics.median(spans), 3) if spans else None
        both = [abs(b[2] - a[2]) / a[2] for a, b in pairwise(stage) if (a[0], b[0]) == ("workers", "gpu")]
        entries.append(entry | {"difference": max(both, default=None)})
    return entries
