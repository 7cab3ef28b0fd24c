"""Writes the results of a folder: a table in CSV, and a web page with pictures."""

import csv
import html
import io
import os
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any
from urllib.parse import quote

from ...model import page_style
from ...model.errors import UserError
from ...model.files import show, write_whole
from ...model.model_file import load
from ...model.remarks import remarks
from ...model.surface_figures import surface_record
from .job import Outcome, Status

TABLE, PAGE = "models.csv", "index.html"
FORMULAS = ("=", "+", "-", "@", "\t", "\r")
"""How texts begin that spreadsheets run."""
STYLE = (
    page_style.STYLE
    + """
ul { list-style: none; padding: 0; display: grid; gap: 1rem;
  grid-template-columns: repeat(auto-fill, minmax(14rem, 1fr)); }
li figure { padding: 0; overflow: hidden; } .failed { border-color: var(--bad); }
li img { width: 100%; aspect-ratio: 1; object-fit: contain; }
figcaption { padding: .5rem .75rem; }
"""
)


@dataclass(frozen=True)
class Row:
    """One line of the table; without a model, the figures are empty."""

    name: str
    status: Status
    shape: str
    """Name of the shape's file."""
    seconds: float | str
    """Training time; wall time of a failed job."""
    parameters: int | str = ""
    bytes: int | str = ""
    """Size of the model's file."""
    mean_f: float | str = ""
    """Mean |f| of the last level on the surface, model units."""
    angle: float | str = ""
    """Mean angle between the last level's normals and the true normals, degrees."""
    distance: float | str = ""
    """Distance between the surfaces of the model and the shape, mean of both directions, model units."""
    reason: str = ""
    """`Outcome.reason`, or what there is to say of the training (model/remarks.py)."""

    def quality(self) -> str:
        """Describe how near the model is to its shape."""
        near = f"mean |f| {self.mean_f:.2e}" if self.distance == "" else f"off by {self.distance:.2e}"
        return f"{near}, normals by {self.angle} degrees"


def row_of(outcome: Outcome) -> Row:
    """Read the figures of a job's model from its file."""
    job, path, status, reason = outcome.job, Path(outcome.job.output), outcome.status, outcome.reason
    seconds, figures = outcome.seconds, dict[str, Any]()
    if status.has_model:
        try:
            model = load(path)
            last, seconds = model.provenance["levels"][-1], float(model.provenance["seconds"])
            figures = {
                "parameters": model.parameters(),
                "bytes": path.stat().st_size,
                "mean_f": float(f"{last['mean_f']:.4g}"),
                "angle": round(float(last["angle"]), 2),
            }
            if record := surface_record(model.provenance):
                figures["distance"] = float(f"{record.shape.distance:.4g}")
            reason = "; ".join(filter(None, (reason, *remarks(model.provenance))))
        except (UserError, OSError, KeyError, IndexError, TypeError, ValueError) as error:
            status, reason = Status.FAILED, f"cannot read the model: {show(str(error))[:160]}"
    return Row(job.name, status, Path(job.shape).name, round(seconds, 1), **figures, reason=reason)


def write_results(folder: Path, rows: Sequence[Row], title: str, left: int) -> None:
    """Write the table and the page into a folder. left: the number of unfinished shapes. Raises UserError."""
    table = io.StringIO()
    writer = csv.DictWriter(table, [field.name for field in fields(Row)], lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: _cell(value) for key, value in asdict(row).items()} for row in rows)
    write_whole(folder / TABLE, table.getvalue())
    write_whole(folder / PAGE, "\n".join(_page(folder, rows, title, left)))


def _link(name: str) -> str:
    """Return the URL of a file beside the page, whose name may be bytes that are no text."""
    return quote(os.fsencode(name))


def _cell(value: object) -> object:
    """Return a text such that a spreadsheet takes it for no formula."""
    return f"'{value}" if isinstance(value, str) and value.startswith(FORMULAS) else value


def _page(folder: Path, rows: Sequence[Row], title: str, left: int) -> Iterable[str]:
    done = sum(row.status.has_model for row in rows)
    failed = sum(row.status is Status.FAILED for row in rows)
    yield f"<!doctype html><html lang=en><meta charset=utf-8><title>{html.escape(title)}</title>"
    yield '<meta name="generator" content="mplicits models">'
    yield f'<meta name=viewport content="width=device-width"><style>{STYLE}</style>'
    yield f"<h1>{html.escape(title)}</h1>"
    counts = [f"{done} models", f"{failed} failed", *([f"{left} to come"] if left else [])]
    yield f"<p>{', '.join(counts)}; <a href={TABLE}>{TABLE}</a></p><ul>"
    for row in sorted(rows, key=lambda row: row.name):
        name, reason = html.escape(row.name), html.escape(row.reason)
        if not row.status.has_model:
            yield f"<li><figure class=failed><figcaption><b>{name}</b><br>{reason or row.status}</figcaption></figure>"
            continue
        link, picture = html.escape(_link(f"{row.name}.safetensors")), folder / f"{row.name}.png"
        yield "<li><figure>"
        if picture.is_file():
            yield f'<img loading=lazy src="{html.escape(_link(picture.name))}" alt="{name}">'
        yield (
            f'<figcaption><a href="{link}">{name}</a><br>{row.quality()}; '
            f"{row.parameters:,} parameters, {row.seconds} s{reason and f'<br>{reason}'}</figcaption></figure>"
        )
    yield "</ul></html>\n"
