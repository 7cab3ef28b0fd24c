"""Draws and measures the models of the gallery: writes docs/gallery.md, docs/gallery/ and docs/demo.png.

    python benchmarks/gallery.py [-o docs/gallery.md] [--front | --scene | --studio | --pages]

Web pages of at most PAGE_MOST bytes are written. Models that are named after their mesh are renamed as their file.
"""

import argparse
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mplicits.bake.registry import TARGETS
from mplicits.codegen.targets.glsl330 import bake
from mplicits.model import gallery
from mplicits.model.errors import UserError
from mplicits.model.files import write_whole
from mplicits.model.model import Model, size_text
from mplicits.model.model_file import load, save, to_bytes
from mplicits.model.surface_figures import surface_record
from mplicits.scenes.compose import compose
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context, open_osmesa
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from mplicits.viewer.draw.screenshot import save_png
from mplicits.web.studio_page import studio
from protocol import Page

SIDE, FRONT_SIDE = 240, 420
"""Pixels per side of a panel, and of a picture in docs/demo.png."""
WHITE = (1.0, 1.0, 1.0), (1.0, 1.0, 1.0)
"""Background at the top and at the bottom, sRGB."""
PAGE_MOST = 80_000
"""Most bytes of a web page that is written."""
STUDIO = "studio.html"
"""Name of the page that trains."""
COMMANDS = (
    "view spot",
    "render spot -o spot.png",
    "render spot --shade texture --level 1 -o coarse.png",
    "render bob --level 1 --normal-level 2 -o bob.png",
    "bake spot --target html -o spot.html",
    "bake spot-small --target shadertoy -o spot.frag",
)
"""Examples on the page."""
SCENE = Path("examples/pond.toml")
"""The scene on the page."""
MOMENTS = (0.0, 0.25, 0.5, 0.75)
"""Times that its picture shows."""
FRONT = (("spot", "softbox"), ("bob", "softbox"))
"""(model, shading) of the pictures that stand side by side in docs/demo.png."""


def panels(levels: int) -> dict[str, RenderOptions]:
    """Return heading -> options of the pictures of a model with this number of levels."""
    all_levels = RenderOptions(samples=16, background=WHITE)
    return {
        "all levels, in soft light": replace(all_levels, shade="softbox"),
        "the texture alone": replace(all_levels, shade="texture"),
        "level 1, same texture": replace(all_levels, shade="texture", level=1),
        "level 1, normals of the last": replace(all_levels, level=1, normal_level=levels),
    }


def strip(model: Model, context: Context, side: int, pictures: Iterable[RenderOptions]) -> NDArray[np.float32]:
    """Draw pictures of a model from its front side by side, each of side x side pixels."""
    renderer = Renderer(context, bake(model, "texture", passes=True))  # literals compile for longer than these draw
    camera = Camera(*(model.front or ()))
    drawn = [renderer.render((side, side), camera, options) for options in pictures]
    renderer.release()
    return np.concatenate(drawn, axis=1)


def draw_front(path: Path, context: Context) -> None:
    """Draw docs/demo.png."""
    pictures = [
        strip(load(gallery.model_path(name)), context, FRONT_SIDE, [RenderOptions(samples=16, shade=shading)])
        for name, shading in FRONT
    ]
    save_png(path, np.concatenate(pictures, axis=1), "Spot and Bob")


def named(name: str, path: Path) -> Model:
    """Load a model of the gallery, and rename it as its file if it is named after its mesh."""
    model = load(path)
    if model.name != name:
        model = replace(model, name=name)
        save(model, path)
    return model


def figures(model: Model) -> str:
    """Return the cells with the distance from the mesh, against its curved surface and against its faces."""
    record = surface_record(model.provenance)
    if record is None:
        level = model.provenance["levels"][-1]
        return f"{level['mean_f']:.1e} | {level['angle']:.1f} | | "
    parts = (record.shape, record.flat)
    return " | ".join(" | " if part is None else f"{part.distance:.1e} | {part.normal_angle:.1f}" for part in parts)


def shadertoy(model: Model) -> str:
    """Return the bytes of the Shadertoy text as a cell of the table, or "too wide"."""
    try:
        return f"{len(TARGETS['shadertoy'](model).encode()):,}"
    except UserError:
        return "too wide"


def scene_lines(folder: Path, context: Context | None) -> list[str]:
    """Draw moments of the example scene, if there is a context, and return its section of the page."""
    model = compose(SCENE)
    if context is not None:
        options = RenderOptions(samples=16, background=WHITE, shade="softbox")
        moments = strip(model, context, SIDE, [replace(options, time=time) for time in MOMENTS])
        save_png(folder / f"{model.name}.png", moments, model.name)
    page, toy = (len(TARGETS[target](model).encode()) for target in ("html", "shadertoy"))
    return [
        "## A scene",
        "",
        f"`mplicits compose {SCENE}` ([scenes](scenes.md)): {len(model.shapes)} models, one of them moving, over a "
        f"ground; {model.parameters():,} parameters, {len(to_bytes(model)):,} bytes as a model file, {page:,} as a "
        f"web page, {toy:,} for Shadertoy. At t = {', '.join(f'{time:g}' for time in MOMENTS)}:",
        "",
        f"![{model.name}]({folder.name}/{model.name}.png)",
    ]


def main() -> None:
    """Write the page, the pictures, and the web pages that are small."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--front", action="store_true", help="draw docs/demo.png alone")
    parser.add_argument("--scene", action="store_true", help="draw the scene alone, and print its section")
    parser.add_argument("--studio", action="store_true", help="write the page that trains alone")
    parser.add_argument("--pages", action="store_true", help="leave the pictures as they are")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/gallery.md"))
    options = parser.parse_args()
    folder = options.output.with_suffix("")
    folder.mkdir(exist_ok=True)
    if options.studio:
        write_whole(folder / STUDIO, studio())
        return
    context, front = None if options.pages else open_osmesa(), options.output.with_name("demo.png")
    if options.front and context is not None:
        draw_front(front, context)
        return
    if options.scene:
        print(*scene_lines(folder, context), sep="\n")
        return
    page = Page(
        options.output,
        "# Gallery",
        "",
        "![Spot and Bob in soft light](demo.png)",
        "",
        "`view`, `render`, `bake`, `mesh` and `info` take these names in place of a model file:",
        "",
        *(f"    mplicits {command}" for command in COMMANDS),
        "",
        "Spot and Bob are by Keenan Crane, CC0. [model/gallery/README.md](../model/gallery/README.md) has the commands "
        "that made the models. `python benchmarks/gallery.py` prints this page.",
        "",
        "| name | levels + texture | parameters | model file, bytes | web page | Shadertoy | trained, s | off by | "
        "normals by | flat: off by | normals by |",
        "| --- | --- |" + " ---: |" * 9,
    )
    paths = {name: gallery.model_path(name) for name in gallery.names()}
    models = {name: named(name, path) for name, path in paths.items()}
    pages = []
    write_whole(folder / STUDIO, studio())
    for name, model in models.items():
        assert model.texture is not None
        text = TARGETS["html"](model)
        if len(text.encode()) <= PAGE_MOST:
            write_whole(folder / f"{name}.html", text)
            pages.append(name)
        levels = ",".join(size_text(level.network) for level in model.levels)
        page.add(
            f"| {name} | {levels} + {size_text(model.texture)} | {model.parameters():,} | "
            f"{paths[name].stat().st_size:,} | {len(text.encode()):,} | {shadertoy(model)} | "
            f"{model.provenance['seconds']:.0f} | {figures(model)} |"
        )
    page.add(
        "",
        "Web page, Shadertoy: bytes. Off by, normals by, flat: [figures](training.md#what-the-figures-mean), radii and "
        "degrees; of a model that moves, mean abs f and the angle of its normals.",
        "",
        "Pages to save and open in a browser, without a network: "
        + ", ".join(f"[{name}.html]({folder.name}/{name}.html)" for name in pages)
        + f"; [{STUDIO}]({folder.name}/{STUDIO}) trains a model of a dropped mesh.",
        "",
        f"From left to right: {'; '.join(panels(1))}. A coarse level wears the finest level's texture (the paper's "
        "Fig. 9).",
        "",
    )
    for name, model in models.items():
        if context is not None:
            save_png(folder / f"{name}.png", strip(model, context, SIDE, panels(len(model.levels)).values()), name)
        page.add(f"{name}:", "", f"![{name}]({folder.name}/{name}.png)", "")
    page.add(*scene_lines(folder, context))
    if context is not None:
        draw_front(front, context)


if __name__ == "__main__":
    main()
