"""What came of the shapes of a folder: a table for programs, and a page with pictures for people."""

import csv
import html
import io
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from urllib.parse import quote

from ...model.errors import UserError
from ...model.files import show, write_whole
from ...model.model_file import load
from .job import Outcome, Status

TABLE, PAGE = "models.csv", "index.html"
"""Names of the files."""
STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #1d1d1f; background: #fafafa; margin: 2rem auto; max-width: 72rem;
  padding: 0 1rem; }
h1 { font-size: 1.4rem; }
ul { list-style: none; padding: 0; display: grid; gap: 1rem;
  grid-template-columns: repeat(auto-fill, minmax(14rem, 1fr)); }
li { background: #fff; border: 1px solid #ddd; border-radius: 8px; overflow: hidden; overflow-wrap: anywhere; }
img { display: block; width: 100%; aspect-ratio: 1; object-fit: contain; }
p { margin: 0; padding: 0.5rem 0.75rem; }
.failed { border-color: #b3261e; }
small { color: #555; }
@media (prefers-color-scheme: dark) {
  body { color: #eee; background: #161616; } li { background: #222; border-color: #444; } small { color: #aaa; }
  a { color: #8ab4f8; } .failed { border-color: #f2b8b5; }
}
"""


@dataclass(frozen=True)
class Row:
    """A line of the table; the figures are those that `train` prints, empty where there is no model."""

    name: str
    status: Status
    shape: str
    """Name of the shape's file."""
    seconds: float | str
    """Of training; of wall time where it failed."""
    parameters: int | str = ""
    bytes: int | str = ""
    """Of the model's file."""
    mean_f: float | str = ""
    """Mean |f| of the last level on the surface, model units."""
    angle: float | str = ""
    """Mean angle of its normals, degrees."""
    reason: str = ""
    """Why it failed."""


def row_of(outcome: Outcome) -> Row:
    """Look up the figures of a job's model."""
    job, path = outcome.job, Path(outcome.job.output)
    bare = Row(job.name, outcome.status, Path(job.shape).name, round(outcome.seconds, 1), reason=outcome.reason)
    if not outcome.status.has_model:
        return bare
    try:
        model = load(path)
        last, seconds = model.provenance["levels"][-1], model.provenance["seconds"]
        return Row(
            job.name,
            outcome.status,
            bare.shape,
            round(float(seconds), 1),
            model.parameters(),
            path.stat().st_size,
            float(f"{last['mean_f']:.4g}"),
            round(float(last["angle"]), 2),
        )
    except (UserError, OSError, KeyError, IndexError, TypeError, ValueError) as error:
        return Row(
            job.name, Status.FAILED, bare.shape, bare.seconds, reason=f"no model to read: {show(str(error))[:160]}"
        )


def write_results(folder: Path, rows: Sequence[Row], title: str, left: int) -> None:
    """Write the table and the page into a folder. left: shapes that are still to come. Raises UserError."""
    table = io.StringIO()
    writer = csv.DictWriter(table, [field.name for field in fields(Row)], lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(row) for row in rows)
    write_whole(folder / TABLE, table.getvalue())
    write_whole(folder / PAGE, "\n".join(_page(folder, rows, title, left)))


def _page(folder: Path, rows: Sequence[Row], title: str, left: int) -> Iterable[str]:
    done = sum(row.status.has_model for row in rows)
    failed = sum(row.status is Status.FAILED for row in rows)
    yield f"<!doctype html><html lang=en><meta charset=utf-8><title>{html.escape(title)}</title>"
    yield f'<meta name=viewport content="width=device-width"><style>{STYLE}</style>'
    yield f"<h1>{html.escape(title)}</h1>"
    counts = [f"{done} models", f"{failed} failed", *([f"{left} to come"] if left else [])]
    yield f"<p><small>{', '.join(counts)}; <a href={TABLE}>{TABLE}</a></small></p><ul>"
    for row in sorted(rows, key=lambda row: row.name):
        name = html.escape(row.name)
        if not row.status.has_model:
            reason = html.escape(row.reason or row.status)
            yield f"<li class=failed><p><b>{name}</b><br><small>{reason}</small></p></li>"
            continue
        link = html.escape(quote(f"{row.name}.safetensors"))
        picture = folder / f"{row.name}.png"
        yield "<li>"
        if picture.is_file():
            yield f'<img loading=lazy src="{html.escape(quote(picture.name))}" alt="{name}">'
        yield (
            f'<p><a href="{link}">{name}</a><br><small>mean |f| {row.mean_f:.2e}, {row.angle} degrees; '
            f"{row.parameters:,} parameters, {row.seconds} s</small></p></li>"
        )
    yield "</ul></html>\n"
