"""What `mplicits info` prints for people, from the facts that `mplicits info --json` prints."""

from collections.abc import Iterator, Mapping
from typing import Any

from ..field.pack import Packed
from ..model.files import show
from ..model.surface_figures import surface_record

LABEL = 12
"""Width of the first column."""
IN_A_ROW = 5
"""Targets whose bytes stand on one line."""
MOST_SECONDS = 1e9
"""A training that took longer is none."""


def describe(facts: Mapping[str, Any]) -> list[str]:
    """Format the facts of a model as lines of text. Escapes texts from its file."""
    lines = [show(facts["name"]) + (f", by {show(facts['credit'])}" if facts["credit"] else "")]
    lines += [f"{label:{LABEL}}{text}" for label, text in _rows(facts)]
    lines += ["", *_levels(facts)]
    return [*lines, "", *_bytes(facts["bytes"])] if "bytes" in facts else lines


def describe_packing(packed: Packed, before: int, after: int) -> str:
    """Describe in one line what packing a model did. before, after: bytes of the files."""
    color = "" if packed.color is None else f", colors by {255 * packed.color:.1f}/255 (root mean square)"
    bands = ", ".join(f"{level.delta:.5f}" for level in packed.model.levels)
    return (
        f"{after:,} bytes instead of {before:,}, {packed.bits:.2f} bits a weight; near the surface, f is off by "
        f"{packed.distance:.1e} on average (the shape has radius 1), normals by {packed.angle:.2f} degrees{color}; "
        f"deltas {bands}"
    )


def _rows(facts: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield (label, text) of each line above the levels."""
    if facts["shapes"]:
        yield "a scene of", ", ".join(map(show, facts["shapes"]))
    colors = f", colors by {facts['texture']}" if facts["texture"] else "" if facts["shapes"] else ", no colors"
    yield "parameters", f"{facts['parameters']:,}{colors}; sha256 {facts['sha256'][:12]}"
    file = facts["file"]
    yield "file", f"{file['bytes']:,} bytes, {file['bits']:.3g} bits a parameter" + ", packed" * file["packed"]
    x, y, z = (f"{c:.4g}" for c in facts["centre"])
    yield "space", f"{facts['up']} is up in the shape's file, its center {x}, {y}, {z}, its radius {facts['scale']:.4g}"
    if facts["front"]:
        azimuth, elevation = facts["front"]
        yield "first view", f"{azimuth:g} degrees around, {elevation:g} above"
    if facts["inputs"] == "xyzt":
        yield "moves", "while t, its fourth input, goes from 0 to 1"
    yield from _history(facts["provenance"])
    yield from (("warning", line) for line in facts["warnings"])


def _history(provenance: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the lines about the training. The provenance of a file may have any content."""
    source, seconds, field = (provenance.get(key) for key in ("source", "seconds", "field"))
    if isinstance(source, dict) and isinstance(source.get("file"), str):
        digest = source.get("sha256")
        yield "trained on", show(source["file"]) + (f", sha256 {show(digest)[:12]}" if isinstance(digest, str) else "")
    moments = source.get("moments") if isinstance(source, dict) else None
    if isinstance(moments, list) and moments:
        files = [moment.get("file") if isinstance(moment, dict) else moment for moment in moments]
        ends = [files[0], *(["..."] if len(files) > 2 else []), *files[-1:]]
        yield "trained on", f"{len(files)} moments: " + ", ".join(show(str(file)) for file in ends)
    if isinstance(seconds, (int, float)) and abs(seconds) < MOST_SECONDS:
        levels = provenance.get("levels")
        records = levels if isinstance(levels, list) else []
        steps = [record.get("steps") for record in records if isinstance(record, dict)]
        counts = f", steps {', '.join(show(str(count)) for count in steps)}" if steps else ""
        unfinished = "; interrupted" if provenance.get("interrupted") else ""
        yield "for", f"{seconds:.0f} s, seed {show(str(provenance.get('seed')))}{counts}{unfinished}"
    if record := surface_record(provenance):
        yield from record.told()
    if isinstance(field, dict) and isinstance(error := field.get("domain_error"), float):
        yield "distance", f"off by {error:.1e} of the radius in the mean of the unit ball"


def _levels(facts: Mapping[str, Any]) -> Iterator[str]:
    """Yield the table of the levels, with the quality that training measured, if the provenance has it."""
    records = facts["provenance"].get("levels")
    records = records if isinstance(records, list) and len(records) == len(facts["levels"]) else []
    figures = [_figures(record) for record in records]
    measured = [f"  {mean:8.1e}  {angle:5.1f}" for mean, angle in filter(None, figures)]
    if len(measured) < len(facts["levels"]):
        measured = []
    yield "level  network  parameters  multiply-adds  sines    delta  iterations  max |grad|  step  band" + (
        "  mean |f|  angle" if measured else ""
    )
    for i, level in enumerate(facts["levels"]):
        row = (
            f"{i + 1:5}  {level['network']:>7}  {level['parameters']:10,}  {level['multiply_adds']:13,}"
            f"  {level['sines']:5,}  {level['delta']:7.5f}  {level['iterations']:10}  {level['lipschitz']:10.2f}"
            f"  {level['step_bound']:4.2f}  {level['band_step_bound']:4.2f}"
        )
        yield row + (measured[i] if measured else "")
    yield "multiply-adds, sines: of one value, with the levels before it; step, band: factors on the steps of rays"
    if measured:
        yield "mean |f|: on the surface, in radii of the shape; angle: of normals there, in degrees"


def _figures(record: object) -> tuple[float, float] | None:
    """Return mean |f| and the mean normal angle of a level's record; None if it lacks them."""
    if not isinstance(record, dict):
        return None
    mean, angle = record.get("mean_f"), record.get("angle")
    return (mean, angle) if isinstance(mean, float) and isinstance(angle, float) else None


def _bytes(sizes: Mapping[str, int | None]) -> Iterator[str]:
    """Yield the lines with the size of each target."""
    most = {"tiny": "at most ", "module": "at most ", "shadertoy": "at most "}
    cells = [f"{name} " + ("none" if size is None else f"{most.get(name, '')}{size:,}") for name, size in sizes.items()]
    for first in range(0, len(cells), IN_A_ROW):
        yield f"{'' if first else 'bytes as':{LABEL}}" + ", ".join(cells[first : first + IN_A_ROW])
