"""The gallery's pictures, web pages and table: writes docs/gallery.md and docs/gallery/.

    PYTHONPATH=. python benchmarks/gallery.py [-o docs/gallery.md]

Small models come with a web page each.
"""

import argparse
from pathlib import Path

from codegen import gallery
from codegen.files import show, write_whole
from codegen.glsl330 import bake
from codegen.model import Model, load, shape_of
from codegen.targets import TARGETS
from protocol import Page
from viewer.camera import Camera
from viewer.context import open_osmesa
from viewer.options import RenderOptions
from viewer.renderer import Renderer
from viewer.screenshot import save_png

SIDE = 256
CAMERA = Camera(40, 20)
SMALL = "-small"


def pictures(levels: int) -> dict[str, RenderOptions]:
    """Heading -> how a model of so many levels is drawn."""
    return {
        "all levels": RenderOptions(samples=4),
        "texture alone": RenderOptions(samples=4, shading="texture"),
        "level 1": RenderOptions(samples=4, level=1),
        "level 1, normals of the last": RenderOptions(samples=4, level=1, normal_level=levels),
    }


def draw(model: Model, name: str, folder: Path) -> str:
    """Writes the pictures of a model; the cells of its row."""
    renderer = Renderer(open_osmesa(), bake(model))
    cells = []
    for i, (heading, options) in enumerate(pictures(len(model.levels)).items(), start=1):
        path = folder / f"{name}-{i}.png"
        save_png(path, renderer.render((SIDE, SIDE), CAMERA, options), name)
        cells.append(f"![{name}, {heading}]({folder.name}/{path.name})")
    renderer.release()
    return " | ".join(cells)


def main() -> None:
    """Writes the page, the pictures, and the web pages of the small models."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/gallery.md"))
    options = parser.parse_args()
    folder = options.output.with_suffix("")
    folder.mkdir(exist_ok=True)
    page = Page(
        options.output, "# Gallery", "",
        "Printed by `PYTHONPATH=. python benchmarks/gallery.py`. `view`, `render`, `bake`, `mesh` and `info` take "
        "these names where a file is expected:", "",
        "    mplicits view spot", "    mplicits render bob --level 1 --normal-level 2",
        "    mplicits bake spot-small --target html -o spot.html", "",
        "Spot and Bob are by Keenan Crane, CC0. The commands that made the models, and the meshes' hashes: "
        "[models/README.md](../models/README.md).", "",
        "| name | levels + texture | parameters | bytes | trained, s | mean abs f | mean normal angle, degrees |",
        "| --- | --- |" + " ---: |" * 5,
    )
    models = {name: load(gallery.model_path(name)) for name in gallery.names()}
    for name, model in models.items():
        assert model.texture is not None
        levels, record = ",".join(shape_of(level.network) for level in model.levels), model.provenance["levels"][-1]
        page.add(f"| {name} | {levels} + {shape_of(model.texture)} | {model.parameters():,} | "
                 f"{gallery.model_path(name).stat().st_size:,} | {model.provenance['seconds']:.0f} | "
                 f"{record['mean_f']:.1e} | {record['angle']:.1f} |")
    page.add("", "Seconds are those of a busy machine.", "")
    for name, model in models.items():
        if name.endswith(SMALL):
            text = TARGETS["html"](model)
            write_whole(folder / f"{name}.html", text)
            page.add(f"[{name}.html]({folder.name}/{name}.html), {len(text.encode()):,} bytes: the model in a web page "
                     "of its own; save it and open it in a browser.", "")
    headings = list(pictures(1))
    page.add(f"| | {' | '.join(headings)} |", "| --- |" + " :---: |" * len(headings))
    for name, model in models.items():
        page.add(f"| {show(name)} | {draw(model, name, folder)} |")


if __name__ == "__main__":
    main()
