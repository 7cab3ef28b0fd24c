"""Draws docs/bands.svg: a slice through Spot with level 1, the band of level 2, and the steps of a ray.

    python benchmarks/bands.py [-o docs/bands.svg]

Contours, bands and steps are those of the gallery's model `spot-small`. The colors read on white and on black.
"""

import argparse
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from skimage.measure import find_contours

import mplicits
from mplicits.model.model import DELTA_FACTOR

SLICE = 0.12
"""x of the slice, which is seen along the x axis: it cuts two legs and an ear."""
GRID = 221
"""Points along each side of the slice, [-1, 1]^2."""
WIDTH, SCALE, TOP = 320, 155, 70
"""Of a panel: width, pixels per unit of length, and the height that its heading takes."""
ORANGE, BLUE, GRAY = "#e8833a", "#3b82f6", "#768390"
EYE, TOWARDS = np.array((0.66, 0.46)), np.array((-0.9, -0.52))
"""Where the ray begins, and its direction: (z, y)."""
HEADINGS = (
    ("Level 1", "a small network f₁, trained everywhere"),
    ("Level 2", "adds a residual, only where |f₁| &lt; δ₁"),
    ("A ray", "takes long steps by f₁, short ones by f₂"),
)

Field = mplicits.Field


def at(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Place points (..., 2) of the slice, (z, y), in space: (..., 3)."""
    return np.concatenate([np.full((*points.shape[:-1], 1), SLICE), points[..., ::-1]], axis=-1)


def pixels(point: Iterable[float]) -> str:
    """Write a point (z, y) in the pixels of a panel."""
    z, y = point
    return f"{WIDTH / 2 + SCALE * z:.1f},{TOP + SCALE * (0.92 - y):.1f}"


def outline(values: NDArray[np.floating], level: float) -> str:
    """Write the contours of `values`, (GRID, GRID) by y and z, at a level as the data of a path."""
    parts = []
    for contour in find_contours(values, level):  # type: ignore[no-untyped-call]
        points = contour[:, ::-1] * 2 / (GRID - 1) - 1
        parts.append("M" + "L".join(pixels(point) for point in points) + "Z")
    return "".join(parts)


def steps(field: Field, delta: float) -> list[tuple[NDArray[np.float64], float, bool]]:
    """Trace the ray: the center of each step, its length, and whether level 2 takes it."""
    direction, t = TOWARDS / np.linalg.norm(TOWARDS), 0.0
    found: list[tuple[NDArray[np.float64], float, bool]] = []
    while len(found) < 30:
        center = EYE + t * direction
        coarse, fine = (float(field(at(center), level=level)) for level in (1, 2))
        inside = abs(coarse) < delta
        length = fine if inside else coarse - delta / DELTA_FACTOR
        found.append((center, length, inside))
        if length < 0.002:
            break
        t += length
    return found


def drawing() -> str:
    """Write the drawing."""
    field = mplicits.load("spot-small")
    delta = field.model.levels[0].delta
    axis = np.linspace(-1, 1, GRID)
    slice_points = at(np.stack(np.meshgrid(axis, axis), axis=-1))
    coarse, fine = field(slice_points, level=1), field(slice_points)
    height = TOP + int(1.86 * SCALE)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {3 * WIDTH} {height}" role="img" font-size="14"',
        ' font-family="system-ui, sans-serif" text-anchor="middle" fill="none" stroke-linejoin="round">',
        "<title>Nested bands: level 1, the band in which level 2 is trained, and the steps of a ray</title>",
    ]
    for panel, (heading, text) in enumerate(HEADINGS):
        x = WIDTH * (panel + 0.5)
        parts.append(f'<text x="{x}" y="24" font-size="18" font-weight="600" fill="{GRAY}">{heading}</text>')
        parts.append(f'<text x="{x}" y="48" fill="{GRAY}">{text}</text>')
    for level in (-0.14, -0.07, 0.07, 0.14):
        faint = 0.75 - 2.5 * abs(level)
        parts.append(f'<path d="{outline(coarse, level)}" stroke="{ORANGE}" opacity="{faint:.2f}"/>')
    parts += [
        f'<path d="{outline(coarse, 0)}" stroke="{ORANGE}" stroke-width="2.5"/>',
        f'<g id="bands" transform="translate({WIDTH})">',
        f'<path d="{outline(np.abs(coarse), delta)}" fill="{ORANGE}" fill-opacity="0.35" fill-rule="evenodd"/>',
        f'<path d="{outline(fine, 0)}" stroke="{BLUE}" stroke-width="2.5"/>',
        "</g>",
        f'<use href="#bands" x="{WIDTH}"/>',
        f'<g transform="translate({2 * WIDTH})">',
    ]
    for center, length, inside in steps(field, delta):
        column, row = pixels(center).split(",")
        color = BLUE if inside else ORANGE
        parts.append(f'<circle cx="{column}" cy="{row}" r="{max(SCALE * abs(length), 1):.1f}" stroke="{color}"/>')
        parts.append(f'<circle cx="{column}" cy="{row}" r="2.2" fill="{color}"/>')
    return "\n".join([*parts, "</g>", "</svg>\n"])


def main() -> None:
    """Write the drawing."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/bands.svg"))
    parser.parse_args().output.write_text(drawing(), encoding="utf-8")


if __name__ == "__main__":
    main()
