"""The page of `mplicits report`: one HTML file about a model and its training, which loads nothing."""

import html
import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..bake.facts import model_facts
from ..model.errors import UserError
from ..model.model import Model
from ..model.page_style import STYLE
from ..model.remarks import remarks
from ..model.surface_figures import surface_record
from . import pictures
from .curves import diagram, read_log, title_of

HEAD = (
    '<!doctype html>\n<html lang="en"><meta charset="utf-8"><meta name="generator" content="mplicits report">'
    '<meta name="viewport" content="width=device-width, initial-scale=1">'
    '<meta http-equiv="Content-Security-Policy" '
    "content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\">"
)
"""The policy keeps the browser from loading or running anything."""
RULES = """
.row { display: flex; flex-wrap: wrap; gap: 1rem; }
.scale { width: 256px; height: 12px; margin-top: .75rem; image-rendering: pixelated; }
.ends { display: flex; justify-content: space-between; width: 256px; font-size: .85rem; color: var(--soft); }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; background: var(--card); }
td, th { border: 1px solid var(--line); padding: .2rem .6rem; text-align: right; font-weight: normal;
  vertical-align: top; }
th { color: var(--soft); } td:first-child, th:first-child { text-align: left; } td.text { text-align: left; }
svg { display: block; width: 100%; max-width: 640px; background: var(--card); border: 1px solid var(--line);
  border-radius: 8px; }
svg text { font-size: 11px; fill: var(--soft); text-anchor: end; dominant-baseline: middle; }
svg .below { text-anchor: middle; } .grid { stroke: var(--line); }
polyline { fill: none; stroke: currentColor; stroke-width: 1.3; } polyline.mean_f { stroke-width: 2.5; }
.legend { list-style: none; padding: 0; margin: .25rem 0; display: flex; flex-wrap: wrap; gap: .2rem 1rem;
  font-size: .9rem; }
.legend i { display: inline-block; width: 1.2em; height: 3px; margin-right: .4em; vertical-align: middle;
  background: currentColor; }
.mean_f { color: #d1495b; } .loss { color: #8d8d8d; } .normal, .along { color: #d9902f; }
.value, .colour { color: #2e86ab; } .distance { color: #3d9970; } .eikonal { color: #9b5de5; }
"""
"""Style of the elements that only this page has."""
FIGURES = {
    "mean_f": ("mean |f|", "{:.2e}"),
    "angle": ("normals off by", "{:.2f} degrees"),
    "steps": ("steps", "{:,.4g}"),
    "seconds": ("seconds", "{:,.1f}"),
    "loss": ("last loss", "{:,.4g}"),
}
"""Key in a level's provenance -> heading on the page, and format."""


def report(
    model: Model, shape: str | Path | None = None, log: str | Path | None = None, *, follow: bool = False
) -> str:
    """Write the page about a model as HTML without scripts.

    shape: path of the true mesh; the page then shows the error on the surface. log: path of the file from `train
    --log`; the page then shows its curves. follow: whether the mesh's file may name files outside of its folder.
    Raises UserError.
    """
    if model.scene is not None:
        raise UserError("this model is a scene, which has no training; report the models of its shapes")
    facts, stages = model_facts(model, sizes=True), None if log is None else read_log(Path(log))
    distances = None if shape is None else pictures.Distances(model, Path(shape), follow=follow)
    parts = [
        f"{HEAD}<title>{html.escape(model.name)}: report</title><style>{STYLE}{RULES}</style>",
        *_top(model, facts),
        '<h2>Levels</h2><div class="row">',
        *(_figure(pictures.url(picture), title) for title, picture in pictures.levels(model)),
        "</div>",
        *_training(model, stages),
        *([] if distances is None else _errors(model, distances)),
        *_slice(model),
        *_bytes(facts),
        *_settings(model),
    ]
    return "\n".join(parts) + "\n"


def _figure(source: str, title: str, caption: str = "") -> str:
    """Write a picture with its caption, by default the title. source: its URL."""
    text = html.escape(caption or title)
    return f'<figure><img alt="{html.escape(title)}" src="{source}"><figcaption>{text}</figcaption></figure>'


def _table(head: Sequence[str], rows: Iterable[Sequence[object]], kind: str = "") -> str:
    """Write a table with escaped cells. kind: class of the cells."""
    attribute = f' class="{kind}"' if kind else ""
    top = "".join(f"<th>{html.escape(cell)}</th>" for cell in head) if any(head) else ""
    lines = ["".join(f"<td{attribute}>{html.escape(str(cell))}</td>" for cell in row) for row in rows]
    return f"<table><tr>{top}</tr>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"


def _top(model: Model, facts: dict[str, Any]) -> Iterator[str]:
    yield f"<h1>{html.escape(model.name)}</h1>"
    levels = " &gt; ".join(html.escape(level["network"]) for level in facts["levels"])
    texture = f", colors by {html.escape(facts['texture'])}" if facts["texture"] else ""
    credit = f"; {html.escape(model.credit)}" if model.credit else ""
    mark = html.escape(facts["sha256"][:12])
    yield f"<p>{levels}{texture}, {facts['parameters']:,} parameters{credit}. sha256 {mark}</p>"


def _training(model: Model, stages: list[list[dict[str, object]]] | None) -> Iterator[str]:
    yield "<h2>Training</h2>"
    records = model.provenance.get("levels")
    rows = [record for record in records if isinstance(record, dict)] if isinstance(records, list) else []
    if len(rows) == len(model.levels):
        yield _table(
            ["", "network", *(heading for heading, _ in FIGURES.values())],
            [
                [f"level {i}", row.get("network"), *(_formatted(key, row.get(key)) for key in FIGURES)]
                for i, row in enumerate(rows, start=1)
            ],
        )
    else:
        yield "<p>The model file has no record of its training.</p>"
    if record := surface_record(model.provenance):
        yield from (f"<p>{label.capitalize()}: {html.escape(text)}.</p>" for label, text in record.told())
    yield from (f"<p>Warning: {html.escape(line)}.</p>" for line in remarks(model.provenance))
    if stages is None:
        yield "<p>Without a log: <code>train --log FILE</code> writes one, <code>report --log</code> draws it.</p>"
        return
    yield "<p>Curves over the steps of each network, on logarithmic axes. Terms are shown without their weights.</p>"
    for stage in stages:
        yield f"<h3>{html.escape(title_of(stage))}</h3>{diagram(stage)}"


def _formatted(key: str, value: object) -> str:
    return FIGURES[key][1].format(value) if isinstance(value, int | float) else ""


def _errors(model: Model, distances: pictures.Distances) -> Iterator[str]:
    images, found = pictures.errors(model, distances)
    yield "<h2>Error on the surface</h2>"
    if not len(found):
        yield "<p>The pictures show no surface.</p>"
        return
    median, high = np.quantile(found, (0.5, 0.95))
    yield (
        f"<p>Distance from the model's visible surface to the true one, in radii of the shape: mean "
        f"{found.mean():.2e}, median {median:.2e}, 95th percentile {high:.2e}.</p>"
    )
    yield '<div class="row">'
    for image, title in zip(images, ("from the front", "from behind"), strict=True):
        yield _figure(pictures.url(image), title)
    yield f'</div><img class="scale" alt="from small to large errors" src="{pictures.url(pictures.legend())}">'
    ends = "".join(f"<span>{end:.0e}</span>" for end in np.geomspace(pictures.BEST, pictures.WORST, 4))
    yield f'<div class="ends">{ends}</div>'


def _slice(model: Model) -> Iterator[str]:
    bands = ", ".join(f"level {i}: {level.delta:.4f}" for i, level in enumerate(model.levels, start=1))
    yield "<h2>A slice of the field</h2>"
    caption = (
        "x = 0, z to the right, y up. Black: the surface. Warm: inside. Cool: outside. Blue: bands of the finer "
        f"levels, darker for finer ones. Contours are 0.1 apart. Band half-widths delta: {bands}."
    )
    yield _figure(pictures.url(pictures.slice_of(model)), "slice", caption)


def _bytes(facts: dict[str, Any]) -> Iterator[str]:
    yield "<h2>Cost and bytes</h2>"
    yield _table(
        ["up to", "parameters", "multiply-adds", "sines", "delta", "largest |grad f|", "step bound"],
        [
            [
                f"level {i} ({level['network']})",
                *(f"{level[key]:,}" for key in ("parameters", "multiply_adds", "sines")),
                f"{level['delta']:.4g}",
                f"{level['lipschitz']:.3g}",
                f"{level['step_bound']:.3g}",
            ]
            for i, level in enumerate(facts["levels"], start=1)
        ],
    )
    yield "<p>Cost of the field at one point, with all levels up to that one.</p>"
    sizes = facts["bytes"].items()
    yield _table(["target", "bytes"], [[name, "refused" if size is None else f"{size:,}"] for name, size in sizes])


def _settings(model: Model) -> Iterator[str]:
    provenance = model.provenance
    names = {"source": "source", "seconds": "seconds of training", "versions": "versions"}
    rows = [[name, json.dumps(provenance[key])] for key, name in names.items() if key in provenance]
    settings = provenance.get("settings")
    if isinstance(settings, dict):
        rows += [[str(key), "" if value is None else json.dumps(value)] for key, value in settings.items()]
    if rows:
        yield "<h2>Settings</h2>"
        yield _table(["", ""], rows, "text")
