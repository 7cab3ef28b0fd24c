"""Counts the bytes to the first picture on the web, for benchmarks/peers.py: three.js with Draco, and our pages."""

import gzip
import re
from collections.abc import Iterator
from pathlib import Path

import minify

from mplicits.bake.registry import TARGETS
from mplicits.model import gallery
from mplicits.model.model_file import load

THREE = Path("/usr/share/javascript/three")
"""Debian's package libjs-three."""
DECODER = ("draco_wasm_wrapper.js", "draco_decoder.wasm")
"""Files of Draco's decoder, in javascript/ of https://github.com/google/draco; no package of Debian has them."""


def packed_size(data: bytes) -> int:
    """Return the bytes that a web server sends."""
    return len(gzip.compress(data, 9, mtime=0))


def script_size(path: Path) -> int:
    """Return the bytes of a module, minified by tdewolff-minify, in gzip."""
    return packed_size(minify.string("application/javascript", path.read_text("utf-8")).encode())


def three_rows(decoder: Path | None) -> Iterator[tuple[str, int | None]]:
    """Count the parts of three.js that show a Draco file. decoder: folder of DECODER; None: not at hand."""
    core = THREE / "build" / "three.module.js"
    if not core.exists():
        yield "three.js: not at hand (apt-get install libjs-three)", None
        return
    revision = re.search(r"REVISION = '(\d+)'", core.read_text("utf-8"))
    total = 0
    parts = {
        f"three.js r{revision[1] if revision else '?'}, core": core,
        "its DRACOLoader": THREE / "examples" / "jsm" / "loaders" / "DRACOLoader.js",
        "its OrbitControls": THREE / "examples" / "jsm" / "controls" / "OrbitControls.js",
    }
    for name, path in parts.items():
        size = script_size(path)
        total += size
        yield name, size
    if decoder is None:
        yield "Draco's decoder: not at hand (`--decoder`), not in the sum", None
    else:
        size = sum(packed_size((decoder / name).read_bytes()) for name in DECODER)
        total += size
        yield "Draco's decoder, WebAssembly", size
    yield "**sum, before any mesh**", total


def page_rows(names: tuple[str, ...]) -> Iterator[tuple[str, int]]:
    """Count our pages of models of the gallery, shape included."""
    for name in names:
        model = load(gallery.model_path(name))
        for target in ("tiny", "html", "module"):
            what = {"tiny": "tiny page", "html": "page, with its poster", "module": "ES module, with its poster"}[
                target
            ]
            yield f"{name}: {what}", packed_size(TARGETS[target](model).encode())
