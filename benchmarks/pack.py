"""Measure the bytes of model files against their errors: float, --packed, and packed; writes docs/results/pack.md.

    python benchmarks/pack.py [--seconds 60] [--keep FOLDER] [-o FILE]

Spot's models are the gallery's; spot-small was trained with --packed. The bunny and the Armadillo are trained.
--keep: a folder where trained models stay for the next run.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from mplicits.field import interpret
from mplicits.field.compensated import output
from mplicits.field.pack import packed
from mplicits.ir.lower import lower
from mplicits.model.gallery import model_path
from mplicits.model.model import Model
from mplicits.model.model_file import load, to_bytes
from mplicits.model.packed_weights import pack
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Shape
from protocol import DATA, Page, machine

SPOT = "textured/spot.obj"
SHAPES = {"spot": SPOT, "spot-small": SPOT, "bunny": "meshes/bunny.ply", "armadillo": "meshes/armadillo.ply"}
BITS = (None, 6.0)
"""Values of --bits; None: auto."""
SAMPLES = 100_000


def errors(model: Model, shape: Shape) -> tuple[float, float, float | None]:
    """Return the means of |f|, of the normals' angle in degrees, and of the colors' difference, on the shape."""
    surface = shape.surface(SAMPLES, np.random.default_rng(5), held_out=True, colors=model.texture is not None)
    points = surface.points.astype(np.float32)
    gradients, values = interpret.field_gradient(lower(model), points, len(model.levels))
    cosine = (gradients * surface.normals).sum(axis=1) / np.linalg.norm(gradients, axis=1)
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    color = None
    if model.texture is not None:
        difference = output(model.texture, points).clip(0, 1) - surface.colors
        color = float(np.sqrt(np.mean(difference**2)))
    return float(np.abs(values).mean()), float(angle.mean()), color


def trained(name: str, folder: Path, seconds: float) -> Model:
    """Train a shape by the command line; or load its model, if an earlier run left it in the folder."""
    from mplicits import cli

    file = folder / f"{name}.safetensors"
    if not file.exists():
        argv = ["train", str(DATA / SHAPES[name]), "-o", str(file), "--seconds", f"{seconds:g}", "--quiet"]
        assert cli.main(argv) == 0
    return load(file)


def main() -> None:
    """Read the command line, and write the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/pack.md"))
    parser.add_argument("--keep", type=Path, metavar="FOLDER")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        write(arguments.output, arguments.seconds, arguments.keep or Path(temporary))


def write(output_file: Path, time_each: float, folder: Path) -> None:
    """Write the page. folder: of trained models."""
    page = Page(
        output_file,
        "# Bytes of model files against their errors",
        "",
        f"Printed by `python benchmarks/pack.py`. {machine()}.",
        "",
        f"Spot's are the gallery's, spot-small trained with `--packed`; the others were trained for {time_each:g} s. "
        "Bytes: of the whole file. Bits: "
        "of the weights, over their number. Distance: mean abs(f) on the shape, in its radii; angle: mean, of the "
        "normals; colors: root mean square difference, of 255; in brackets, over those of the float file.",
        "",
        "| model | weights | parameters | bytes | bits | distance | angle | colors | s | load, s |",
        "| --- | --- | ---: | ---: | ---: | --- | --- | --- | ---: | ---: |",
    )
    for name, file in SHAPES.items():
        shape, _ = load_shape(str(DATA / file), crease=30.0)
        model = load(model_path(name)) if name.startswith("spot") else trained(name, folder, time_each)
        exact = errors(model, shape)
        row(page, name, "`--packed`" if name == "spot-small" else "float", model, exact, exact, 0.0)
        for bits in BITS:
            began = time.perf_counter()
            result = packed(model, bits)
            seconds = time.perf_counter() - began
            label = f"`pack --bits {'auto' if bits is None else f'{bits:g}'}`"
            row(page, name, label, result.model, errors(result.model, shape), exact, seconds)


def row(
    page: Page,
    name: str,
    label: str,
    model: Model,
    found: tuple[float, float, float | None],
    exact: tuple[float, float, float | None],
    seconds: float,
) -> None:
    """Add a row to the page. found, exact: of `errors`, of this model and of the float model."""
    data, codes = to_bytes(model), pack(model.networks())
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "m.safetensors")
        path.write_bytes(data)
        began = time.perf_counter()
        load(path)
        loading = time.perf_counter() - began
    bits = 32.0 if codes is None else 8 * len(codes) / model.parameters()
    color = "" if found[2] is None or exact[2] is None else f"{255 * found[2]:.1f} ({found[2] / exact[2]:.2f})"
    page.add(
        f"| {name} | {label} | {model.parameters():,} | {len(data):,} | {bits:.2f} "
        f"| {found[0]:.2e} ({found[0] / exact[0]:.2f}) | {found[1]:.2f} ({found[1] / exact[1]:.2f}) | {color} "
        f"| {seconds:.0f} | {loading:.3f} |"
    )


if __name__ == "__main__":
    main()
