"""What a page of a shipped model should show: the picture of `mplicits render`, or of its Shadertoy text on OSMesa."""

import re
from pathlib import Path

import numpy as np
from PIL import Image

from mplicits.viewer.draw.context import Context
from support.likeness import LEAST, check_alike, psnr
from support.shadertoy import picture
from support.stranger import Stranger
from support.tabs import Picture, Tab, steady

SIZE, SHARE = (480, 360), 1 / 3
"""CSS pixels of a window, and pixels for each, along each axis: a CPU draws them."""
PIXELS = (160, 120)
"""Pixels of a picture."""
DRAG = ((200, 150), (260, 170))
"""Where a drag begins and ends, CSS pixels."""
STILL = "document.documentElement.dataset.state === 'still'"
"""Whether a page's picture is complete."""


def inner(picture: Picture) -> Picture:
    """Return the part of a page's picture that nothing covers."""
    height, width = picture.shape[:2]
    return picture[round(0.25 * height) : round(0.65 * height), round(0.2 * width) : round(0.8 * width)]


def rendered(
    shipped: Stranger,
    model: str,
    camera: str = "",
    shade: str = "softbox",
    size: tuple[int, int] = PIXELS,
    more: str = "--samples 16",
) -> Picture:
    """Return the picture that `mplicits render` draws of a model; where it is transparent, (H, W, 4).

    camera: hash of a page's address. more: further options of `render`.
    """
    values = dict(part.split("=") for part in camera.lstrip("#").split("&") if part)
    view = ",".join(values[key] for key in ("az", "el", "d") if key in values)
    file = re.sub(r"[^\w.,-]+", "_", f"{Path(model).name} {view} {shade} {size[0]}x{size[1]} {more}")
    path = shipped.folder / "pictures" / f"{file}.png"
    if not path.exists():
        shipped.run("mkdir -p pictures")
        words = f"--size {size[0]}x{size[1]} --shade {shade} {more}" + (f" --camera={view}" if view else "")
        shipped.run(f"mplicits render {model} {words} -o '{path}'")
    return np.asarray(Image.open(path).convert("RGBA" if "--transparent" in more else "RGB"), np.int16)


def check_rendered(
    picture: Picture, shipped: Stranger, model: str, camera: str, name: str, shade: str = "softbox"
) -> None:
    """Compare the inner part of a picture with `mplicits render`. camera, model: of `rendered`; name: of files."""
    height, width = picture.shape[:2]
    drawn = list[Picture]()
    for samples in (16, 1, 4, 2):  # a page on a busy machine ends with few
        drawn.append(inner(rendered(shipped, model, camera, shade, (width, height), f"--samples {samples}")))
        if psnr(inner(picture), drawn[-1]) >= LEAST:
            return
    check_alike(inner(picture), name, *drawn)


def check_page(tab: Tab, shipped: Stranger, name: str) -> None:
    """Compare a page of a model with `mplicits render`, before and after a drag."""
    tab.until(STILL)
    check_rendered(steady(tab), shipped, name, "", f"{name}-page")
    tab.drag(*DRAG)
    tab.until(f"location.hash && {STILL}")
    check_rendered(steady(tab), shipped, name, tab.evaluate("location.hash"), f"{name}-page-turned")


def check_tiny(tab: Tab, shipped: Stranger, name: str, osmesa: Context) -> None:
    """Compare a tiny page with its Shadertoy text, before and after a drag."""
    text = (shipped.folder / "site" / f"{name}.frag").read_text(encoding="utf-8")
    texts = (text, text.replace("#define AA 1", "#define AA 2"))
    width, height = (round(tab.share * side) for side in tab.size)
    x, y, to_x, to_y = (tab.share * number for point in DRAG for number in point)
    drag = (to_x, height - to_y, x, height - y)
    tab.until("document.querySelector('canvas')?.width > 100")
    for mouse, suffix in (((0.0, 0.0, 0.0, 0.0), ""), (drag, "-turned")):
        if suffix:
            tab.drag(*DRAG)
        drawn = [inner(picture(osmesa, each, mouse, size=(width, height))) for each in texts]
        # A browser rounds the pointer's place: a third of a degree moves the edges, which one sample leaves hard.
        check_alike(inner(steady(tab)), f"{name}-tiny{suffix}", *drawn, least=25 if suffix else LEAST)
