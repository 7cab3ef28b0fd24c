"""Compares files of shapes by bytes and errors: Draco, meshopt, SDF textures, Poisson, one SIREN, and ours.

    pip install pymeshlab matplotlib
    PYTHONPATH=tests python benchmarks/peers.py [--shapes NAME,..] [--keep FOLDER] [--decoder FOLDER] [-o FILE]

Writes docs/results/peers.md, and a curve for each shape beside it. The same code measures all methods. --keep: a folder
in which models, and the rows of finished shapes, stay for the next run. --decoder: a folder with Draco's decoder for
the web, draco_wasm_wrapper.js and draco_decoder.wasm (https://github.com/google/draco, folder javascript).
"""

import argparse
import io
import json
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image

import peers_meshes as meshes
import peers_models as models
import peers_volumes as volumes
import studio_page
from mplicits.readers.paint import Picture
from mplicits.readers.values import Doubles, Integers
from mplicits.trainer.machine import device, prepare
from mplicits.trainer.openmp import prepare_openmp
from mplicits.trainer.options import CREASE
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.mesh import MeshShape
from peers_meshes import Coded, Triangles
from peers_page import write
from peers_rows import DRACO, DRACO_COLORS, OURS, Row
from peers_surface import Paint, Surface, Truth
from protocol import DATA

FACES = (500, 1000, 2000, 4000, 8000, 16_000, 32_000)
"""Triangles of simplified meshes."""
PAINTED, TEXTURES = (4000, 8000, 16_000), ((64, 50), (128, 30), (128, 75), (256, 50), (512, 50))
"""Triangles of textured meshes; pixels along a side of WebP images, and their quality."""
TEXELS = (64, 96, 128)
"""Along each side of SDF textures."""
RECONSTRUCTED = (4000, 8000, 16_000)
"""Triangles that the mesh of Poisson is simplified to."""


@dataclass(frozen=True)
class Case:
    """A shape of the page."""

    file: str | None
    """In the data folder; None: the gear of the page that trains."""
    gallery: tuple[str, ...] = ()
    """Models of the gallery that stand for ours; none: ours are trained."""


CASES = {
    "bunny": Case("meshes/bunny.ply"),
    "armadillo": Case("meshes/armadillo.ply"),
    "spot": Case("textured/spot.obj", ("spot-small", "spot")),
    "gear": Case(None),
}


class Comparison:
    """The comparison of one shape."""

    def __init__(self, name: str, case: Case, folder: Path) -> None:
        """folder: of models, and of the gear's file."""
        path = folder / f"{name}.ply" if case.file is None else DATA / case.file
        if case.file is None and not path.exists():
            studio_page.write_example(name, path)
        shape, _ = load_shape(str(path), crease=CREASE)
        assert isinstance(shape, MeshShape)
        self._name, self._case, self._shape, self._shelf = name, case, shape, models.Shelf(folder)
        self._mesh = meshes.of_shape(shape)
        self._truth = Truth(self._mesh.surface(self._paint(None)))

    def parts(self) -> dict[str, Callable[[], Iterator[Row]]]:
        """Return what makes the files and measures them, by name."""
        return {
            "ours": self._ours,
            "meshes": self._coded_meshes,
            "painted": self._painted_meshes,
            "volumes": self._volumes,
            "siren": self._siren,
        }

    def _ours(self) -> Iterator[Row]:
        if self._case.gallery:
            named = models.of_gallery(self._case.gallery)
        else:
            named = models.ours(self._shape, self._name, self._shelf)
        for each in named:
            for make in (models.files, models.texts):
                for result in make(OURS, each, self._shelf):
                    yield self._row(result.method, result.setting, result.size, result.surface)

    def _siren(self) -> Iterator[Row]:
        single = models.siren(self._shape, self._name, self._shelf)
        for result in models.files("one SIREN", single, self._shelf):
            yield self._row(result.method, result.setting, result.size, result.surface)

    def _row(self, method: str, setting: str, size: int, surface: Surface, seconds: float | None = None) -> Row:
        errors = self._truth.errors(surface)
        row = Row(method, setting, size, errors.distance, errors.angle, errors.color, seconds)
        print(self._name, row, flush=True)
        return row

    def _meshes(self, counts: tuple[int, ...], plain: bool) -> Iterator[tuple[str, Triangles]]:
        """Simplify the true surface; a small file's own mesh comes last. plain: without texture coordinates."""
        whole, own = self._mesh, meshes.of_file(self._shape)
        if plain:
            whole, own = (replace(mesh, uv=None) for mesh in (whole, own))
        for count in counts:
            if count < len(whole.faces):
                mesh = meshes.simplified(whole, count)
                yield f"{len(mesh.faces):,} triangles", mesh
        if len(own.faces) <= max(counts):
            yield f"the file's {len(own.faces):,} triangles", own

    def _coded_meshes(self) -> Iterator[Row]:
        """Code meshes without colors."""
        for setting, mesh in self._meshes(FACES, plain=True):
            fewest = round(np.log2(len(mesh.faces)) / 2 + 4)
            for normals in (None, self._truth.surface):
                for bits in (fewest, fewest + 1, fewest + 3):
                    yield self._coded(DRACO, meshes.draco, setting, mesh, bits, normals)
                yield self._coded("meshopt", meshes.meshopt, setting, mesh, fewest + 1, normals)

    def _coded(
        self,
        method: str,
        code: Callable[[Triangles, int, Surface | None], Coded],
        setting: str,
        mesh: Triangles,
        bits: int,
        normals: Surface | None,
    ) -> Row:
        coded = code(mesh, bits, normals)
        setting = f"{setting}, {bits} bits{'' if normals is None else ', normals'}"
        return self._row(method, setting, coded.size, coded.decoded.surface())

    def _painted_meshes(self) -> Iterator[Row]:
        """Code meshes with texture coordinates, and images for them."""
        if self._mesh.uv is None:
            return
        for setting, mesh in self._meshes(PAINTED, plain=False):
            bits = round(np.log2(len(mesh.faces)) / 2 + 4)
            for method, code in ((DRACO_COLORS, meshes.draco), ("meshopt and WebP", meshes.meshopt)):
                coded = code(mesh, bits, None)
                for side, quality in TEXTURES:
                    size, picture = self._webp(side, quality)
                    surface = coded.decoded.surface(_textured(coded.decoded, picture))
                    yield self._row(
                        method, f"{setting}, {bits} bits, {side}^2, quality {quality}", coded.size + size, surface
                    )

    def _volumes(self) -> Iterator[Row]:
        """Make SDF textures, and reconstruct a cloud."""
        cloud = self._truth.surface.sample(volumes.CLOUD, np.random.default_rng(2))
        for count in TEXELS:
            texture = volumes.texture(self._shape, cloud, count)
            yield self._row("SDF texture", f"{count}^3", texture.size, texture.surface())
        began = time.process_time()
        mesh = volumes.poisson(cloud)
        seconds = time.process_time() - began
        for count in RECONSTRUCTED:
            small = meshes.simplified(mesh, count)
            bits = round(np.log2(count) / 2 + 4)
            coded = meshes.draco(small, bits)
            setting = f"{len(small.faces):,} triangles, {bits} bits"
            yield self._row("Poisson", setting, coded.size, coded.decoded.surface(), seconds)

    def _paint(self, picture: Picture | None) -> Paint | None:
        """Return the colors of the true surface. picture: in place of its own."""
        if self._mesh.uv is None:
            return None
        return _textured(self._mesh, picture or self._picture())

    def _picture(self) -> Picture:
        """Return the shape's image."""
        assert self._shape._paint is not None
        return next(each.picture for each in self._shape._paint.materials if each.picture is not None)

    def _webp(self, side: int, quality: int) -> tuple[int, Picture]:
        """Return the bytes of the shape's image as WebP, and the image that they hold."""
        own, stream = self._picture(), io.BytesIO()
        image = Image.fromarray(own.pixels).resize((side, side), Image.Resampling.LANCZOS)
        image.save(stream, "WEBP", quality=quality, method=6)
        pixels = np.asarray(Image.open(io.BytesIO(stream.getvalue())).convert("RGB"))
        return len(stream.getvalue()), replace(own, pixels=pixels)


def _textured(mesh: Triangles, picture: Picture) -> Paint:
    """Return the colors of a mesh with an image."""
    uv = mesh.uv
    assert uv is not None

    def paint(_points: Doubles, faces: Integers, weights: Doubles) -> Doubles:
        return picture.at(np.einsum("nk,nki->ni", weights, uv[faces]))

    return paint


def compared(name: str, folder: Path) -> list[Row]:
    """Compare a shape, or read the rows of an earlier run."""
    comparison, found = Comparison(name, CASES[name], folder), list[Row]()
    for part, make in comparison.parts().items():
        file = folder / f"{name}-{part}.json"
        if not file.exists():
            file.write_text(json.dumps([asdict(row) for row in make()], indent=1), encoding="utf-8")
        found += [Row(**row) for row in json.loads(file.read_text("utf-8"))]
    return found


def main() -> None:
    """Write the page and its pictures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--shapes", default=",".join(CASES), metavar="NAME,..")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="folder of models and rows")
    parser.add_argument("--decoder", type=Path, metavar="FOLDER", help="folder of Draco's decoder for the web")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/peers.md"))
    options = parser.parse_args()
    prepare_openmp()
    prepare(device("cpu"))
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.keep or Path(temporary)
        folder.mkdir(exist_ok=True)
        found = {name: compared(name, folder) for name in options.shapes.split(",")}
    write(options.output, found, options.decoder)


if __name__ == "__main__":
    main()
