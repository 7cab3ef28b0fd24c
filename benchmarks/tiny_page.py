"""Measure what each part of a tiny page saves; writes docs/results/tiny_page.md.

    python benchmarks/tiny_page.py [--models spot-small,spot] [-o FILE]

--models: names of the gallery, or files. Every row changes one thing of the page that `bake --target tiny` writes.
"""

import argparse
import base64
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from mplicits.codegen.printers.packed import PackedStorage
from mplicits.codegen.targets.shadertoy import Emitted, emitted
from mplicits.codegen.targets.shadertoy_text import shader_text
from mplicits.model.gallery import model_path
from mplicits.model.model import Model
from mplicits.model.model_file import load
from mplicits.web import tiny_page
from mplicits.web.base124 import base124
from mplicits.web.minified import short_script
from protocol import Page, machine

UNITS = 65536 - 2048 - 2
"""Code units that UTF-16 text in HTML may hold: all but surrogates, 0 and 13."""


class AsText(PackedStorage):
    """Packed weights that stay in the shader's text."""


def adaptive_bytes(numbers: NDArray[np.int64]) -> float:
    """Return the bytes of numbers in an adaptive arithmetic code, which counts each value so far, plus 1/2."""
    _, values = np.unique(numbers, return_inverse=True)
    counts = np.full(2 * int(np.abs(numbers).max()) + 1, 0.5)
    bits = 0.0
    for value in values:
        bits -= np.log2(counts[value] / counts.sum())
        counts[value] += 1
    return float(bits / 8)


def even_bytes(numbers: NDArray[np.int64]) -> float:
    """Return the bytes of numbers as digits of one large number, as if all values were equally frequent."""
    return float(len(numbers) * np.log2(2 * int(np.abs(numbers).max()) + 1) / 8)


def zlib_stream(data: bytes) -> bytes:
    """Return zlib's raw deflate stream."""
    return zlib.compress(data, 9)[2:-4]


def as_base94(data: bytes) -> str:
    """Return as many characters as base 94 needs: eleven for nine bytes."""
    return "x" * -(-11 * len(data) // 9)


def sizes(model: Model) -> dict[str, int]:
    """Return the bytes of the page, and of pages that differ in one thing."""
    chosen = emitted(model)
    parts = tiny_page.script_parts(chosen, model, None)
    as_text = Emitted(chosen.program, AsText, chosen.further)

    def size(other: tuple[dict[str, Any], bytes] = parts, **changed: Any) -> int:
        with patch.multiple(tiny_page, **{"base124": base124} | changed):
            return len(tiny_page.page_text(other, model).encode())

    runs: list[NDArray[np.int64]] = []
    payload: list[int] = []

    def keep(numbers: NDArray[np.int64], _weights: object) -> int:
        runs.append(numbers.ravel())
        return 0

    def count(data: bytes) -> str:
        payload.append(len(data))
        return ""

    with patch.object(tiny_page, "_add", keep):
        tiny_page.script_parts(chosen, model, None)
    runs = [run for run in runs if len(run)]

    def coded(bytes_of: Callable[[NDArray[np.int64]], float]) -> int:
        return size((parts[0], b"")) + round(1000 / 869 * sum(map(bytes_of, runs)))

    page = size()
    outside = size(base124=count)
    units = int(np.ceil(8 * payload[0] / np.log2(UNITS)))
    return {
        "Shadertoy's text": len(shader_text(chosen.program, model, chosen.storage, chosen.further, None).encode()),
        "**the page**": page,
        "weights: Shadertoy's digits in the deflated shader": size(tiny_page.script_parts(as_text, model, None)),
        "weights: digits of one large number": coded(even_bytes),
        "weights: an adaptive arithmetic code": coded(adaptive_bytes),
        "text: base 64": size(base124=lambda data: base64.b64encode(data).decode()),
        "text: base 94": size(base124=as_base94),
        "text: UTF-16 with a mark, for the whole file": 2 * (1 + outside + units),
        "text: bytes as windows-1252 (broken where a server says UTF-8)": outside + round(payload[0] * 259 / 256),
        "scripts: names as they are": size(minified=short_script),
        "constants of WebGL: by name": size(GL={name: f"gl.{name}" for name in tiny_page.GL}),
        "deflate: by zlib instead of Zopfli": size(deflated=zlib_stream),
    }


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--models", default="spot-small,spot")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/tiny_page.md"))
    options = parser.parse_args()
    models = [load(model_path(name)) for name in options.models.split(",")]
    page = Page(
        options.output,
        "# What makes a tiny page tiny",
        "",
        f"Printed by `python benchmarks/tiny_page.py`. {machine()}.",
        "",
        "Bytes of `bake --target tiny`, and of pages that differ in one thing. UTF-16 doubles the HTML around the "
        "packed text. Rows of UTF-16, windows-1252 and other codes of the weights count bytes: no such page was "
        "written, and a script that reads the code comes on top.",
        "",
        "| | " + " | ".join(model.name for model in models) + " |",
        "| --- |" + " ---: |" * len(models),
    )
    rows = [sizes(model) for model in models]
    for name in rows[0]:
        page.add(f"| {name} | " + " | ".join(f"{row[name]:,}" for row in rows) + " |")


if __name__ == "__main__":
    main()
