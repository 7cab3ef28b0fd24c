"""Prints the page of results of studio.py."""

import statistics
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import studio_page
from protocol import Page, machine

POINTS = 100_000
"""Points of a surface at which fields and colors are measured."""
SAMPLES = 300_000
"""Points on each surface for the Chamfer distance."""


@dataclass(frozen=True)
class Row:
    """A trained model's figures, or their medians. Lengths in radii of the shape, angles in degrees."""

    seconds: float
    """From the drop, or the start of the command, to the end."""
    steps: float
    """Of the last level."""
    flat_f: float
    """Mean |f| on the flat faces of the file."""
    flat_angle: float
    """Mean angle between the field's gradient and the faces' normals."""
    curved_f: float
    """Mean |f| on the curved surface that both sides make of the faces, and train."""
    curved_angle: float
    chamfer: float
    """Chamfer distance to the file's faces, divided by its floor."""
    components: float
    """Closed components of the model's surface."""
    colors: float
    """Mean squared error of the colors, sRGB in [0, 1]; NaN without colors."""


@dataclass(frozen=True)
class Result:
    """The trainings of a shape."""

    page: list[Row]
    command: list[Row]
    watched: list[studio_page.Watched]


def median(rows: list[Row]) -> Row:
    """Return the medians of all figures."""
    return Row(*(statistics.median(column) for column in zip(*(vars(row).values() for row in rows), strict=True)))


def table_rows(name: str, preset: str, result: Result) -> list[str]:
    """Return the lines of a shape in the first table."""
    page, command = median(result.page), median(result.command)

    def line(head: str, row: Row) -> str:
        colors = "" if np.isnan(row.colors) else f"{row.colors:.2e}"
        return (
            f"| {head} | {row.seconds:.1f} | {row.steps:,.0f} | {row.flat_f:.2e} | {row.flat_angle:.2f} | "
            f"{row.curved_f:.2e} | {row.curved_angle:.2f} | {row.chamfer:.2f} | {row.components:g} | {colors} |"
        )

    def ratio(of: Callable[[Row], float]) -> str:
        return f"{of(page) / of(command):.2f}"

    colors, shown = "" if np.isnan(page.colors) else ratio(lambda row: row.colors), f"{name}, `{preset}`"
    return [
        line(f"{shown} | page", page),
        line(" | train", command),
        f"| | page / train | {ratio(lambda row: row.seconds)} | {ratio(lambda row: row.steps)} | "
        f"{ratio(lambda row: row.flat_f)} | {ratio(lambda row: row.flat_angle)} | {ratio(lambda row: row.curved_f)} | "
        f"{ratio(lambda row: row.curved_angle)} | {ratio(lambda row: row.chamfer)} | | {colors} |",
    ]


def page_row(name: str, watched: list[studio_page.Watched]) -> str:
    """Return a shape's line in the table of the page alone."""

    def middle(of: Callable[[studio_page.Watched], float | None]) -> float:
        known = [number for one in watched if (number := of(one)) is not None]
        return statistics.median(known) if known else float("nan")

    return (
        f"| {name} | {middle(lambda one: one.mesh):.2f} | {middle(lambda one: one.field):.2f} | "
        f"{1000 * middle(lambda one: one.block):.0f} | {middle(lambda one: one.memory) / 1e6:,.0f} | "
        f"{middle(lambda one: one.browser) / 1e6:,.0f} |"
    )


def report(output: Path, changed: str, repeat: int, rows: list[str], page_rows: list[str]) -> None:
    """Write the page of results. changed: the options that are not the default, as text."""
    Page(
        output,
        "# The page that trains against `mplicits train`",
        "",
        f"Printed by `PYTHONPATH=tests python benchmarks/studio.py{changed}`. {machine()}.",
        "",
        "Headless Chromium with SwiftShader, a window of 1280 x 800, then `mplicits train`, in turn and alone on the "
        f"machine; the same preset, seconds and seed{f', medians of {repeat}' if repeat > 1 else ''}. "
        "The gear is the page's example, the rope its built-in shape (`mplicits train demo`).",
        "",
        "- Seconds: from the drop to the end, or of the whole command with its survey of the surface. Steps: of the "
        "last level.",
        f"- Mean abs f, radii of the shape, and mean angle between gradient and normal, degrees, at {POINTS:,} points: "
        "on the file's flat faces, and on the curved surface that both sides train (`--crease`). The rope's file is "
        "the page's mesh; `train` knows the exact shape.",
        f"- Chamfer: to the file's faces, squared L2, {SAMPLES:,} samples on each side, marching cubes at 512^3, "
        "divided by that of two samplings of the file. Components: of that surface. Colors: mean squared error, sRGB "
        "in [0, 1].",
        "",
        "| shape | by | seconds | steps | flat: mean abs f | flat: angle | curved: mean abs f | curved: angle | "
        "Chamfer of the floor | components | colors |",
        "| --- | --- |" + " ---: |" * 9,
        *rows,
        "",
        "## What a visitor sees",
        "",
        "Seconds from the drop to the pictures of mesh and field. Longest block: between two ticks of a timer of 10 "
        "ms. Memory: peaks of the page's process, and of all of the browser, whose shared pages count several times.",
        "",
        "| shape | mesh, s | field, s | longest block, ms | page, MB | browser, MB |",
        "| --- |" + " ---: |" * 5,
        *page_rows,
    )
