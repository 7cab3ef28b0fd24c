"""Trains shapes in the studio's page in headless Chromium, and watches the page meanwhile."""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import trimesh

from mplicits.web.bundle import script
from mplicits.web.studio_page import studio
from support.browser import Visit, chromium, visit

if TYPE_CHECKING:
    from playwright.sync_api import Browser

WINDOW = (1280, 800)
"""CSS pixels; one device pixel each."""
PATIENCE = 4
"""A training that takes this multiple of its seconds, plus two minutes, has failed."""
EXAMPLES = {"rope": 0, "vase": 1, "gear": 2}
"""Name of an example on the page -> its index."""
_WATCH = """() => {
    const root = document.documentElement, of = (id) => document.getElementById(id);
    const seen = window.studioSeen = {dropped: null, mesh: null, field: null, ended: null, block: 0, blockAt: null};
    const drop = () => { seen.dropped ??= performance.now(); };
    of("file").addEventListener("change", drop, {capture: true});
    of("examples").addEventListener("click", drop, {capture: true});
    new MutationObserver(() => {
        if (seen.dropped === null) return;
        const isMesh = root.hasAttribute("data-preview");
        if (!isMesh && seen.mesh !== null) seen.field ??= performance.now();
        if (!isMesh || seen.isAsked) return;
        seen.isAsked = true;
        // The mesh is drawn in the next frame, and shown before the one after.
        requestAnimationFrame(() => requestAnimationFrame(() => { seen.mesh ??= performance.now(); }));
    }).observe(root, {attributes: true});
    new MutationObserver(() => {
        if (!of("longer").hidden) seen.ended ??= performance.now();
    }).observe(of("longer"), {attributes: true});
    let last = performance.now();
    setInterval(() => {
        const now = performance.now(), isTraining = seen.dropped !== null && seen.ended === null;
        if (isTraining && now - last > seen.block) Object.assign(seen, {block: now - last, blockAt: last});
        last = now;
    }, 10);
}"""
_SETTINGS = """([preset, seconds, seed]) => {
    document.querySelector(`input[name=preset][value=${preset}]`).click();
    const {elements} = document.getElementById("settings");
    elements.seconds.value = String(seconds);
    elements.seed.value = String(seed);
}"""


@dataclass(frozen=True)
class Watched:
    """What was seen of a training in the page. Seconds count from the drop."""

    seconds: float
    """To the end."""
    mesh: float | None
    """To the picture of the mesh."""
    field: float | None
    """To the first picture of the field."""
    block: float
    """Longest time between two ticks of a timer of 10 ms, in seconds."""
    block_at: float
    """When it began."""
    memory: float
    """Most memory that the process of the page had, bytes."""
    browser: float
    """Sum of the most memory of each process of the browser, bytes: shared pages count several times."""


@contextmanager
def opened(folder: Path, scheme: str = "dark") -> Iterator[Visit]:
    """Open the studio. folder: where its file is written. scheme: "dark" or "light"."""
    path = folder / "studio.html"
    path.write_text(studio(), encoding="utf-8")
    with chromium() as browser, visit(browser, path, size=WINDOW, share=1, color_scheme=scheme) as visited:
        visited.until("'ready' in document.documentElement.dataset")
        yield visited


def train(visited: Visit, shape: Sequence[Path] | int, preset: str, seconds: float, seed: int = 0) -> Watched:
    """Train a shape in an opened page. shape: files that are chosen together, or the index of an example.

    Raises RuntimeError with the page's message where it refuses.
    """
    page = visited.page
    page.evaluate(_SETTINGS, [preset, seconds, seed])
    page.evaluate(_WATCH)
    if isinstance(shape, int):
        page.click(f"[data-example='{shape}']")
    else:
        page.set_input_files("#file", list(shape))
    patience = 1000 * (PATIENCE * seconds + 120)
    page.wait_for_function(
        "() => window.studioSeen.ended !== null || !document.getElementById('message').hidden", timeout=patience
    )
    if message := visited.message():
        raise RuntimeError(message)
    seen, (memory, browser) = page.evaluate("() => window.studioSeen"), _memory(page.context.browser)
    began = seen["dropped"]
    mesh, field, ended, block_at = (
        None if seen[key] is None else (seen[key] - began) / 1000 for key in ("mesh", "field", "ended", "blockAt")
    )
    assert ended is not None
    return Watched(ended, mesh, field, seen["block"] / 1000, block_at or 0.0, memory, browser)


def save(visited: Visit, path: Path) -> None:
    """Save the model by the page's button."""
    with visited.page.expect_download() as download:
        visited.page.click("#download")
    download.value.save_as(path)


def write_example(name: str, path: Path) -> None:
    """Write an example's mesh as a PLY file, with its colors."""
    call = f"const {{vertices, faces, colors}} = EXAMPLES[{EXAMPLES[name]}].make();"
    plain = "return [vertices, faces, colors?.vertex ?? []].map((array) => [...array]);"
    with chromium() as browser:
        page = browser.new_page()
        made = page.evaluate(f"() => {{ {script(('examples.js',))} {call} {plain} }}")
    vertices, faces, colors = (np.array(rows, np.float64).reshape(-1, 3) for rows in made)
    tints = np.rint(255 * colors).astype(np.uint8) if len(colors) else None
    trimesh.Trimesh(vertices, faces.astype(np.int64), process=False, vertex_colors=tints).export(path)


def _memory(browser: "Browser | None") -> tuple[float, float]:
    """Return `memory` and `browser` of Watched."""
    assert browser is not None
    session = browser.new_browser_cdp_session()
    processes = session.send("SystemInfo.getProcessInfo")["processInfo"]
    session.detach()
    peaks = [(process["type"], _peak(process["id"])) for process in processes]
    return max(peak for kind, peak in peaks if kind == "renderer"), sum(peak for _, peak in peaks)


def _peak(process: int) -> float:
    """Return the most resident memory that a process had, bytes; 0 where it has ended."""
    try:
        status = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return 0.0
    found = re.search(r"VmHWM:\s+(\d+) kB", status)
    return 1024.0 * int(found[1]) if found else 0.0
