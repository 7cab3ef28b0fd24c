"""Draws the curves of docs/results/peers.md: errors against bytes."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from peers_rows import DRACO, DRACO_COLORS, ERRORS, OURS, Row, front_of

COLORS = {
    OURS: "#d62728",
    DRACO: "#1f77b4",
    "meshopt": "#2ca02c",
    "SDF texture": "#9467bd",
    "Poisson": "#8c564b",
    "one SIREN": "#e8a33d",
}
"""First words of a method -> color of its curve."""
MARKERS = {"file": "o", "packed file": "D", "Shadertoy text": "s", "tiny page": "^", "page": "v"}
"""Form of a model -> marker."""


def draw(path: Path, name: str, rows: Sequence[Row]) -> None:
    """Draw a shape's errors against bytes, and save the picture."""
    mpl.rcParams |= {"svg.hashsalt": name, "svg.fonttype": "none", "font.family": "sans-serif", "font.size": 9}
    errors = [error for error in ERRORS if any(getattr(row, error) is not None for row in rows)]
    figure = Figure(figsize=(4.4 * len(errors), 4.4), layout="constrained")
    all_axes = figure.subplots(1, len(errors), squeeze=False)[0]
    labels = {"distance": "mean distance, radii", "angle": "normals, degrees", "color": "colors, of 255"}
    for axes, error in zip(all_axes, errors, strict=True):
        for method in dict.fromkeys(row.method for row in rows):
            front = front_of([row for row in rows if row.method == method], error)
            if not front:
                continue
            first, _, form = method.partition(", ")
            color = next(shade for start, shade in COLORS.items() if first.startswith(start))
            axes.plot(
                [row.size for row in front],
                [getattr(row, error) for row in front],
                marker=MARKERS.get(form, "x" if first == DRACO_COLORS else "."),
                color=color,
                linewidth=1.6 if first == OURS else 1,
                linestyle="--" if first == DRACO_COLORS else "-",
                label=method,
                markersize=6 if first == OURS else 5,
            )
        axes.set(xscale="log", yscale="log", xlabel="bytes", ylabel=labels[error])
        axes.grid(which="both", color="#ddd", linewidth=0.5)
    figure.legend(*all_axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.savefig(path, metadata={"Date": None})
