"""The page of `mplicits report`: what is known of a model and its training, in one file that asks for nothing else."""

import html
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..bake.facts import model_facts
from ..model.errors import UserError
from ..model.model import Model
from . import drawn
from .curves import diagram, read_log, title_of
from .look import HEAD, STYLE, figure, table

MEASURED = {
    "mean_f": "mean |f|",
    "angle": "normals off by",
    "steps": "steps",
    "seconds": "seconds",
    "loss": "last loss",
}
"""Key in a level's provenance -> what the page calls it."""


def report(model: Model, shape: str | Path | None = None, log: str | Path | None = None) -> str:
    """Make the page about a model: HTML, whole, without scripts, that loads nothing.

    shape: the path of the mesh that is the truth, for the error on the surface. log: the path of what `train --log`
    wrote, for curves. Raises UserError.
    """
    if model.scene is not None:
        raise UserError("this model is a scene, which was not trained; report the models that it is made of")
    stages = None if log is None else read_log(Path(log))
    truth = None if shape is None else drawn.Distances(model, Path(shape))
    parts = [
        f"{HEAD}<title>{html.escape(model.name)}: report</title><style>{STYLE}</style>",
        *_top(model),
        *_pictures(model),
        *_training(model, stages),
        *([] if truth is None else _errors(model, truth)),
        *_slice(model),
        *_bytes(model),
        *_settings(model),
    ]
    return "\n".join(parts) + "\n"


def _top(model: Model) -> Iterator[str]:
    facts = model_facts(model)
    yield f"<h1>{html.escape(model.name)}</h1>"
    shown = " &gt; ".join(html.escape(level["network"]) for level in facts["levels"])
    texture = f", colours by {html.escape(facts['texture'])}" if facts["texture"] else ""
    credit = f"; {html.escape(model.credit)}" if model.credit else ""
    mark = html.escape(facts["sha256"][:12])
    yield f"<p>{shown}{texture}, {facts['parameters']:,} parameters{credit}. sha256 {mark}</p>"


def _pictures(model: Model) -> Iterator[str]:
    yield '<h2>Levels</h2><div class="row">'
    for title, picture in drawn.levels(model):
        yield figure(drawn.url(picture), title)
    yield "</div>"


def _training(model: Model, stages: list[list[dict[str, object]]] | None) -> Iterator[str]:
    yield "<h2>Training</h2>"
    records = model.provenance.get("levels")
    names = [f"level {i}" for i in range(1, len(model.levels) + 1)]
    rows = [record for record in records if isinstance(record, dict)] if isinstance(records, list) else []
    if len(rows) == len(names):
        yield table(
            ["", "network", *MEASURED.values()],
            [
                [name, row.get("network"), *(_shown(key, row.get(key)) for key in MEASURED)]
                for name, row in zip(names, rows, strict=True)
            ],
        )
    else:
        yield "<p>The model does not say how it was trained.</p>"
    if stages is None:
        yield "<p>No log was given: <code>train --log FILE</code> keeps one, <code>report --log</code> draws it.</p>"
        return
    yield "<p>Over the steps of each network; every axis of values is logarithmic. Terms are without their weights.</p>"
    for stage in stages:
        yield f"<h3>{html.escape(title_of(stage))}</h3>{diagram(stage)}"


def _shown(key: str, value: object) -> str:
    if not isinstance(value, int | float):
        return ""
    return {"mean_f": f"{value:.2e}", "angle": f"{value:.2f} degrees", "seconds": f"{value:,.1f}"}.get(
        key, f"{value:,.4g}"
    )


def _errors(model: Model, truth: drawn.Distances) -> Iterator[str]:
    pictures, distances = drawn.errors(model, truth)
    yield "<h2>Error on the surface</h2>"
    if not len(distances):
        yield "<p>No surface is in sight.</p>"
        return
    middle, high = np.quantile(distances, (0.5, 0.95))
    yield (
        f"<p>Distance from the model's surface to the shape's, in radii of the shape, where a pixel sees it: "
        f"{distances.mean():.2e} in the mean, {middle:.2e} in the median, {high:.2e} for 95 of 100.</p>"
    )
    yield '<div class="row">'
    for picture, title in zip(pictures, ("from the front", "from behind"), strict=True):
        yield figure(drawn.url(picture), title)
    yield f'</div><img class="scale" alt="from small errors to large ones" src="{drawn.url(drawn.legend())}">'
    ends = "".join(f"<span>{end:.0e}</span>" for end in np.geomspace(drawn.BEST, drawn.WORST, 4))
    yield f'<div class="ends">{ends}</div>'


def _slice(model: Model) -> Iterator[str]:
    bands = ", ".join(f"level {i} within {level.delta:.4f}" for i, level in enumerate(model.levels, start=1))
    yield "<h2>A slice of the field</h2>"
    caption = (
        "x = 0, z to the right, y up. Black: the surface. Warm: inside, cool: outside. Blue: where finer levels "
        f"answer, the darker the finer. Lines of equal distance are 0.1 apart. Half widths of bands: {bands}."
    )
    yield figure(drawn.url(drawn.slice_of(model)), "slice", caption)


def _bytes(model: Model) -> Iterator[str]:
    facts = model_facts(model)
    yield "<h2>Cost and bytes</h2>"
    yield table(
        ["up to", "parameters", "multiply-adds", "sines", "delta", "largest |grad f|", "step bound"],
        [
            [
                f"level {i} ({level['network']})",
                f"{level['parameters']:,}",
                f"{level['multiply_adds']:,}",
                f"{level['sines']:,}",
                f"{level['delta']:.4g}",
                f"{level['lipschitz']:.3g}",
                f"{level['step_bound']:.3g}",
            ]
            for i, level in enumerate(facts["levels"], start=1)
        ],
    )
    yield "<p>Of one point of the field, all levels up to that one.</p>"
    sizes = facts["bytes"].items()
    yield table(["target", "bytes"], [[name, "refused" if size is None else f"{size:,}"] for name, size in sizes])


def _settings(model: Model) -> Iterator[str]:
    provenance = model.provenance
    named = {"source": "source", "seconds": "seconds taken", "versions": "versions"}
    rows = [[name, json.dumps(provenance[key])] for key, name in named.items() if key in provenance]
    settings = provenance.get("settings")
    if isinstance(settings, dict):
        rows += [[str(key), "" if value is None else json.dumps(value)] for key, value in settings.items()]
    if rows:
        yield "<h2>Settings</h2>"
        yield table(["", ""], rows, "text")
