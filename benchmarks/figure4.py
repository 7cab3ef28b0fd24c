"""Draws with deltas that are too small and too large (Figure 4): writes docs/results/figure4.md and its pictures.

    python benchmarks/figure4.py armadillo.safetensors [--azimuth 210] [-o docs/results/figure4.md]

Rendering scales all bands by one factor. A hole is a background pixel whose ray meets the last level's surface by dense
marching with the model's own deltas; pictures show holes in red. "single" is the paper's one pass: 20 steps of level 1,
then 5 of each finer level, each as long as the field's value. "ours" is `mplicits render --schedule plain`.
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dense_view import STOP, closest_approach
from mplicits.codegen.targets.glsl330 import bake
from mplicits.ir.lower import lower
from mplicits.model.model import DEFAULT_ITERATIONS, DEFAULT_STEP_BOUND, Model, shape_of
from mplicits.model.model_file import load
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import open_osmesa
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from mplicits.viewer.draw.screenshot import save_png
from protocol import Page, machine

SIDE = 320
"""Pixels per side of a picture."""
SCALES = (0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 2.0, 4.0, 8.0, 16.0)
"""Factors on the deltas, one row of the table each."""
PICTURED = {0.2: "too small", 1.0: "Eq. 5", 4.0: "too large"}
"""Factor -> heading of its picture."""
RED = (0.9, 0.05, 0.05)
"""Color of a hole, sRGB."""
MARCHES = {
    "single": RenderOptions(
        schedule="plain", iterations=DEFAULT_ITERATIONS, rounds=1, step_scale=1 / DEFAULT_STEP_BOUND
    ),
    "ours": RenderOptions(schedule="plain"),
}
"""Name in the table -> how rays are traced: by full steps, or by the steps of a file without bounds."""


@dataclass(frozen=True)
class Comparison:
    """A picture by sphere tracing, compared with dense marching."""

    holes: NDArray[np.bool_]
    """(SIDE, SIDE): background pixels whose rays meet the surface."""
    extra: int
    """Pixels of the shape whose rays miss the surface."""
    steps: float
    """Mean number of steps of the rays that take any."""


class Scene:
    """A model and a camera, for sphere tracing and dense marching."""

    def __init__(self, model: Model, camera: Camera) -> None:
        self._camera, self._renderer = camera, Renderer(open_osmesa(), bake(model))
        self._closest = closest_approach(lower(model), camera, SIDE)
        self.covered = int((self._closest == 0).sum())

    def compare(self, options: RenderOptions) -> Comparison:
        """Draw with these options, and compare hits with dense marching."""
        data = self._renderer.render((SIDE, SIDE), self._camera, replace(options, shade="data"))
        hit, steps = data[..., 3] > 0.5, data[..., 1]
        return Comparison(
            (self._closest == 0) & ~hit, int((hit & (self._closest > STOP)).sum()), float(steps[steps > 0].mean())
        )

    def picture(self, options: RenderOptions, holes: NDArray[np.bool_], path: Path) -> None:
        """Draw the shaded picture, paint the holes (SIDE, SIDE) and write it."""
        image = self._renderer.render((SIDE, SIDE), self._camera, options).copy()
        image[holes, :3] = RED
        save_png(path, image)


def main() -> None:
    """Write the page and the pictures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("model", type=Path, metavar="M.safetensors")
    parser.add_argument("--azimuth", type=float, default=210, metavar="DEGREES")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/figure4.md"))
    options = parser.parse_args()
    model = load(options.model)
    bound = DEFAULT_STEP_BOUND
    levels = (replace(level, step_bound=bound, band_step_bound=bound) for level in model.levels)
    model = replace(model, levels=tuple(levels))
    scene = Scene(model, Camera(azimuth=options.azimuth))
    page = Page(
        options.output,
        "# Figure 4: deltas that are too small and too large",
        "",
        f"Printed by `python benchmarks/figure4.py {options.model.name} --azimuth {options.azimuth:g}`. {machine()}.",
        "",
        f"Levels {', '.join(shape_of(level.network) for level in model.levels)}, deltas "
        f"{', '.join(f'{level.delta:.4f}' for level in model.levels)} by Eq. 5, all scaled by one factor at rendering; "
        f"{SIDE} x {SIDE}, OSMesa.",
        "",
        f"- Holes (red): dense marching with the model's own deltas meets the surface ({scene.covered:,} pixels), and "
        "the picture shows background.",
        "- Extra: the picture shows the shape, and the ray passes at over 1/20 pixel.",
        "- Single: the paper's one pass, 20 steps of level 1, then 5 of each finer level, by our shader.",
        "- Ours: `mplicits render --schedule plain`.",
        "",
        "| deltas times | single: holes | extra | mean steps | ours: holes | extra | mean steps |",
        "| ---: |" + " ---: |" * 6,
    )
    rows: dict[str, list[str]] = {march: [] for march in MARCHES}
    for scale in SCALES:
        cells = [f"{scale:g}"]
        for march, unscaled in MARCHES.items():
            scaled = replace(unscaled, delta_scale=scale)
            comparison = scene.compare(scaled)
            holes = int(comparison.holes.sum())
            cells += [
                f"{holes} ({100 * holes / scene.covered:.1f} %)",
                f"{comparison.extra}",
                f"{comparison.steps:.1f}",
            ]
            if scale in PICTURED:
                name = f"figure4-{march}-{PICTURED[scale].replace(' ', '-').replace('.', '').lower()}.png"
                scene.picture(scaled, comparison.holes, options.output.with_name(name))
                rows[march].append(f"![{march}, deltas times {scale:g}: {holes} holes]({name})<br>{holes} holes")
        page.add(f"| {' | '.join(cells)} |")
    headings = [f"{text} (x {scale:g})" for scale, text in PICTURED.items()]
    page.add(
        "",
        f"| | {' | '.join(headings)} |",
        "| --- |" + " :---: |" * len(headings),
        *(f"| {march} | {' | '.join(row)} |" for march, row in rows.items()),
    )


if __name__ == "__main__":
    main()
