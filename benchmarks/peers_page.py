"""Writes docs/results/peers.md from the rows of benchmarks/peers.py: tables, curves, and sentences about them."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import peers_meshes as meshes
import peers_models as models
import peers_volumes as volumes
from mplicits.trainer.options import CREASE
from peers_curves import draw
from peers_rows import FROM, Row, losses, table, verdict
from peers_surface import SAMPLES
from peers_web import page_rows, three_rows
from protocol import Page, machine

SHOWN = ("spot-small", "spot")
"""Models of the gallery whose pages are counted."""
HEAD = (
    f"Distance: mean of the distances of {SAMPLES:,} points of each surface to the other, radii of the shape. Normals: "
    "mean angle at these points, degrees. Colors: root mean square difference, of 255. The true surface is what "
    f"`mplicits train` learns: the file's, curved except at creases of {CREASE:g} degrees.",
    "",
    f"- Ours: `small` and `base` with {','.join(map(str, models.STEPS))} steps; of Spot, the gallery's models. "
    f"Measured through a mesh of {models.GRID}^3 cells, with the field's normals and colors. Files: float32; packed: "
    "`mplicits pack`. Text: in gzip. Pages: with their viewer.",
    "- Draco (level 10) and meshopt (in gzip): the true surface, simplified by quadrics (MeshLab), without a "
    f"container. Normals where the setting says so ({meshes.NORMAL_BITS} bits in Draco, 8 in meshopt); "
    "else the decoder computes them, smooth but for creases. Decoders are not counted.",
    f"- SDF texture: 8 bits, distances up to {volumes.NEAR:g} texels, trilinear, in gzip. Poisson: screened, from "
    f"{volumes.CLOUD:,} points with normals, depth {volumes.DEPTH}, in Draco; processor seconds.",
    "- One SIREN: about as many weights, and as many steps, as `base`; by our trainer, without colors.",
    "- Left out: rows that another of their method beats in all columns, and of close ones all but one.",
)
VERDICT = (
    "Bytes with which Draco reaches each error of ours, interpolated between its files. It holds where the largest of "
    "these is not below ours."
)
LOSSES = (
    "Bytes with which a method reaches all errors of our packed file, where they are fewer; and errors that no file of "
    "ours reaches, with the smallest file of each method that does."
)
WEB = "Scripts without comments, in gzip. Ours hold the shape; three.js's parts do not."


def write(path: Path, found: Mapping[str, Sequence[Row]], decoder: Path | None) -> None:
    """Write the page, and a picture for each shape beside it. decoder: as of `three_rows`."""
    page = Page(
        path,
        "# Bytes against quality: other ways to keep a shape",
        "",
        f"Printed by `PYTHONPATH=tests python benchmarks/peers.py`. {machine()}.",
        "",
        *HEAD,
    )
    for name, rows in found.items():
        picture = path.with_name(f"peers-{name}.svg")
        draw(picture, name, rows)
        page.add("", f"## {name}", "", f"![{name}: errors against bytes]({picture.name})", "", *table(rows))
    page.add("", f"## Our packed files against Draco's, from {FROM:,} bytes on", "", VERDICT, "")
    for name, rows in found.items():
        page.add(*verdict(name, rows))
    page.add("", "## Where we lose", "", LOSSES, "")
    for name, rows in found.items():
        page.add(*losses(name, rows))
    page.add("", "## Bytes to the first picture on the web", "", WEB, "", "| | bytes |", "| --- | ---: |")
    for what, size in (*three_rows(decoder), *page_rows(SHOWN)):
        page.add(f"| {what} | {'' if size is None else f'{size:,}'} |")
