"""The studio's reader of dropped files, called in Chromium."""

import base64
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mplicits.web.bundle import modules, script

if TYPE_CHECKING:
    from playwright.sync_api import Browser

Files = Mapping[str, bytes]
"""Path -> content."""
Read = Callable[[Files], dict[str, Any]]
_SCRIPT = """
const unpacked = ([path, text]) => ({
    name: path.slice(path.lastIndexOf("/") + 1), path,
    bytes: Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer,
});

// Returns what readShape finds, with the colors of points of every face; or the message of a MeshError.
window.readFiles = async (files) => {
    try {
        const {colors, vertices, faces, cloudNormals, ...more} = await readShape(files.map(unpacked));
        const found = {...more, vertices: [...vertices], faces: [...faces], normals: cloudNormals && [...cloudNormals]};
        if (!colors) return found;
        if (!faces.length) return {...found, colors: [...colors.vertex]};
        const surface = new SurfaceColors(colors, faces), at = [], sampled = [0, 0, 0];
        for (let face = 0; face < faces.length / 3; ++face) {
            const s = 0.1 + 0.6 * (0.618 * face % 1), t = (1 - s) * (0.414 * face % 1);
            surface.write(face, s, t, sampled, 0);
            at.push([s, t, ...sampled]);
        }
        return {...found, sampled: at};
    } catch (error) {
        if (error instanceof MeshError && !(error.cause instanceof ReferenceError)) return {refused: error.message};
        throw error;
    }
};

// Returns the milliseconds of a million sines.
const sines = () => {
    const began = performance.now();
    let sum = 0;
    for (let k = 0; k < 3e6; ++k) sum += Math.sin(sum + k);
    return Number.isFinite(sum) && (performance.now() - began) / 3;
};

// Returns lists of files that readShape neither reads nor refuses in one line: [place, what happened]; and the longest
// time of a call, in million sines.
window.tryFiles = async (cases) => {
    const wrong = [];
    let longest = 0;
    for (const [place, files] of cases.entries()) {
        const list = files.map(unpacked), began = performance.now();
        try {
            const {vertices, faces} = await readShape(list);
            if (!vertices.length || !vertices.every(Number.isFinite)) wrong.push([place, "odd vertices"]);
            if (faces.some((index) => index >= vertices.length / 3)) wrong.push([place, "odd faces"]);
        } catch (error) {
            const isExpected = error instanceof MeshError && !(error.cause instanceof ReferenceError);
            if (!isExpected || /[\\n\\r]/.test(error.message)) wrong.push([place, String(error.stack)]);
        }
        longest = Math.max(longest, performance.now() - began);
    }
    return [wrong, longest / sines()];
};
"""


def packed(files: Files) -> list[list[str]]:
    """Convert files for JavaScript."""
    return [[path, base64.b64encode(data).decode()] for path, data in files.items()]


class Reader:
    """readShape in a page of Chromium."""

    def __init__(self, page: Any) -> None:
        self._page = page

    def __call__(self, files: Files) -> dict[str, Any]:
        """Return what the page reads: arrays (N, 3), or `refused`.

        `sampled` is (F, 5) of colored meshes: s, t and the color of a point of each face.
        """
        found: dict[str, Any] = self._page.evaluate("files => readFiles(files)", packed(files))
        for key in ("vertices", "faces", "normals", "colors"):
            if found.get(key) is not None:
                found[key] = np.reshape(found[key], (-1, 3))
        if "faces" in found:
            found["faces"] = found["faces"].astype(int)
        if "sampled" in found:
            found["sampled"] = np.array(found["sampled"])
        return found

    def attempt(self, cases: list[Files]) -> tuple[list[tuple[int, str]], float]:
        """Read damaged files. Returns places of cases with what went wrong, and the longest time in million sines."""
        wrong, longest = self._page.evaluate("cases => tryFiles(cases)", [packed(files) for files in cases])
        return wrong, longest


@contextmanager
def shape_reader(browser: "Browser") -> Iterator[Reader]:
    """Open a page that reads files."""
    page = browser.new_page()
    page.evaluate(f"{script(modules('load_shape.js'))} {_SCRIPT} null;")
    yield Reader(page)
    page.close()


def files_at(*paths: Path) -> Files:
    """Read files."""
    return {path.name: path.read_bytes() for path in paths}


def points_of(found: dict[str, Any]) -> np.ndarray:
    """Return the points (F, 3) at which colors were sampled."""
    s, t = found["sampled"][:, :2].T[:, :, None]
    a, b, c = (found["vertices"][found["faces"][:, k]] for k in range(3))
    return np.asarray((1 - s - t) * a + s * b + t * c)
