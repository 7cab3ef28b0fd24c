"""Turn what on_gpu.py found into pages in docs/results.

    python benchmarks/results_of_gpu.py FOLDER... [--pages docs/results]

FOLDER: where on_gpu.py wrote its report; a stage that is done in a later folder replaces that of an earlier one.
Writes gpu.md, and table2.md where Table 2 was measured.
"""

import argparse
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from stages import REPORT
from table2 import ROWS

Stages = dict[str, dict[str, Any]]
"""Name of a stage -> "status", "seconds" and "results"."""
GOAL_FPS, GOAL_OVER_SIREN, GOAL_OVER_LAYERED, GOAL_STUDIO_FPS = 1000, 5, 10, 60
SLOW_CARD_TFLOPS = 2.0
"""float32 TFLOP/s of an integrated GPU, for which the studio's frames per second are extrapolated."""
KERNEL_METRICS = (
    "Duration",
    "Compute (SM) Throughput",
    "L2 Cache Throughput",
    "Registers Per Thread",
    "Achieved Occupancy",
    "Warp Cycles Per Issued Instruction",
)


def merged(reports: Iterable[Stages]) -> Stages:
    """Merge reports: of each stage, the last one that is done, or else the last one that ran, or else the last."""
    rank = {"done": 2, "failed": 1, "stopped": 1, "skipped": 0}
    stages: Stages = {}
    for report in reports:
        for name, stage in report.items():
            if name not in stages or rank[stage["status"]] >= rank[stages[name]["status"]]:
                stages[name] = stage
    return stages


def table(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> list[str]:
    """Format a table; None becomes an empty cell. Returns a line that says so where there are no rows."""
    rows = list(rows)
    if not rows:
        return ["", "Not measured.", ""]
    lines = [f"| {' | '.join(columns)} |", "|" + " --- |" * len(columns)]
    for row in rows:
        cells = ("" if cell is None else f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in row)
        lines.append(f"| {' | '.join(cells)} |")
    return ["", *lines, ""]


def rates(results: dict[str, Any]) -> dict[tuple[str, str, str], dict[str, Any]]:
    """Return the rows of the stage `table2` by (title, schedule, variant)."""
    return {(row["row"], row["schedule"], row["variant"]): row for row in results.get("rows", [])}


def table2_page(results: dict[str, Any], machine: str) -> list[str]:
    """Format the page of Table 2."""
    found, peaks = rates(results), results.get("peaks", {})
    kinds = [("relaxed", "simple"), ("relaxed", "fused"), ("plain", "simple"), ("plain", "fused")]
    kinds += [("plain", "layered"), ("plain", "layered-one-round")]
    rows = []
    for title, _, _, paper in ROWS:
        measured = [found.get((title, *kind), {}) for kind in kinds]
        fused = measured[1]
        share = fused.get("useful_share")
        rates_of_row = (round(row["fps"], 1) if row else None for row in measured)
        of_fused = (fused.get("useful_tflops"), f"{share:.1%}" if share else None, fused.get("psnr"))
        rows.append((title, paper, *rates_of_row, *of_fused))
    names = ["model", "paper", *(f"{variant}, {schedule}" for schedule, variant in kinds), "TFLOP/s", "of peak", "dB"]
    return [
        "# Table 2: frames per second at 512 x 512, CUDA",
        "",
        "Measured by `benchmarks/on_gpu.py`, written by `benchmarks/results_of_gpu.py`.",
        "",
        f"{machine}. Models of Armadillo, trained in few steps: their widths set the speed. Medians of frames by CUDA "
        "events. layered: cuBLAS, one product per layer over all pixels, until every ray is done; one round: the "
        "paper's 20 steps of level 1 and 5 of each finer level, which leaves holes. TFLOP/s, share of the measured "
        f"matrix peak (the larger of mma.sync's and cuBLAS's: {max(peaks.values(), default=None)} TFLOP/s) "
        "and PSNR against simple (float32): of fused, relaxed. "
        "The paper's column: RTX 5090, its own renderer and networks. Empty cells were not measured.",
        *table(names, rows),
    ]


def goals(stages: Stages) -> list[tuple[str, object, str]]:
    """Return each goal that something was measured for: (goal, measured, reached or missed)."""
    found = rates(stages.get("table2", {}).get("results", {}))
    fps = {(title, variant): row["fps"] for (title, schedule, variant), row in found.items() if schedule == "relaxed"}
    largest, siren = ROWS[-1][0], ROWS[0][0]
    wanted: list[tuple[str, float, float]] = []
    if (largest, "fused") in fps:
        wanted.append((f"{largest}, frames per second at 512 x 512", fps[largest, "fused"], GOAL_FPS))
        if (siren, "fused") in fps:
            ratio = fps[largest, "fused"] / fps[siren, "fused"]
            wanted.append(("its ratio to the (256, 4) SIREN, drawn the same way", ratio, GOAL_OVER_SIREN))
        plain = [found.get((title, "plain", "fused")) for title in (largest, siren)]
        if plain[0] and plain[1]:
            ratio = plain[0]["fps"] / plain[1]["fps"]
            wanted.append(("the same ratio, both by the plain schedule", ratio, GOAL_OVER_SIREN))
        if layered := found.get((largest, "plain", "layered")):
            wanted.append(
                (
                    "its ratio to layered",
                    fps[largest, "fused"] / layered["fps"],
                    GOAL_OVER_LAYERED,
                )
            )
    drawn = stages.get("glsl", {}).get("results", {})
    share, peak = (
        drawn.get("fragment_share", {}).get("share"),
        stages.get("machine", {}).get("results", {}).get("float32_tflops"),
    )
    for frame in drawn.get("frames", []):
        if (frame["model"], frame["shade"], frame["height"], frame["storage"]) == ("spot", "softbox", 1080, "auto"):
            wanted.append(("spot, studio, 1080p, GLSL, frames per second", frame["fps"], GOAL_STUDIO_FPS))
            if peak and share:
                name = f"the same on a card of {SLOW_CARD_TFLOPS:g} TFLOP/s (extrapolated)"
                wanted.append((name, 1e3 / frame["gpu_ms"] * SLOW_CARD_TFLOPS / (share * peak), GOAL_STUDIO_FPS))
    return [
        (name, float(value), f"{'reached' if value >= goal else 'MISSED'}: at least {goal}")
        for name, value, goal in wanted
    ]


def seconds_to(curve: Sequence[Sequence[float]], mean_f: float) -> float | None:
    """Return when a training's last level first had a mean |f| this low, in seconds."""
    return next((seconds for seconds, _, value in curve if value <= mean_f), None)


def training_rows(runs: list[dict[str, Any]]) -> Iterable[Sequence[object]]:
    """Yield the rows of the training table."""
    of_cpu = {run["preset"]: run for run in runs if run["device"] == "cpu" and run.get("levels")}
    for run in runs:
        last, cpu = run["levels"][-1], of_cpu.get(run["preset"])
        steps = " + ".join(str(level["steps"]) for level in run["levels"])
        reached = (
            seconds_to(run["curve"], cpu["curve"][-1][2]) if cpu and cpu["curve"] and run["device"] != "cpu" else None
        )
        yield run["shape"], run["preset"], run["device"], steps, last["mean_f"], last["angle"], reached


def glsl_section(found: dict[str, Any]) -> list[str]:
    """Format the section about GLSL."""
    lines = ["## GLSL", "", f"{found.get('renderer', 'not measured')}; one ray per pixel."]
    columns, figures = ("model", "storage", "shade"), ("fps", "gpu_ms", "compile_seconds")
    frames = (
        (
            *(frame[column] for column in columns),
            f"{frame['width']}x{frame['height']}",
            *(frame[key] for key in figures),
        )
        for frame in found.get("frames", [])
    )
    lines += table((*columns, "size", "fps", "GPU, ms", "compiling, s"), frames)
    late = [f"{case['model']}, {case['storage']}, {case['late']}" for case in found.get("skipped", [])]
    if late:
        lines += [f"Without a frame: {'; '.join(dict.fromkeys(late))}.", ""]
    share = found.get("fragment_share", {})
    if "share" in share:
        lines += [
            f"Share of the card that fragment shaders get: {share['share']:.3g}. The same loop takes "
            f"{share['compute_ms']:.3g} ms as a compute shader, {share['fragment_ms']:.3g} ms as a fragment shader.",
            "",
        ]
    elif share:
        lines += [f"Share of the card that fragment shaders get: not measured. {share['missing']}.", ""]
    lines += ["Frames of spot, studio, by CUDA, which has no such share:"]
    names = ("variant", "size", "fps", "milliseconds")
    return [*lines, *table(names, ([row[name] for name in names] for row in found.get("cuda_frames", [])))]


def wgsl_section(found: dict[str, Any]) -> list[str]:
    """Format the section about WGSL."""
    lines = ["## WGSL on Vulkan", "", f"{', '.join(found.get('adapters', ['not measured']))}."]
    if len(evaluations := list(found.get("evaluations", {}).items())) == 2:
        (few, fewer), (many, more) = evaluations
        seconds = max(found[f"seconds_{many}"] - found[f"seconds_{few}"], 1e-9)
        lines += [f"Evaluations of spot in a second, compiling and copying left out: {(more - fewer) / seconds:.3g}."]
    lines += [
        f"Largest difference from numpy: {found.get('largest_difference', 'not measured')}.",
        "",
        f"A training step of the studio page (`web/kernel/step.wgsl`) on {found.get('trainer_adapter', 'no card')}: "
        "with writing the samples and weights and reading the gradient back, as the page does, and its dispatches "
        "alone. Difference: of the gradient from torch.autograd in 64 bits, relative to each weight's largest entry.",
    ]
    columns = ("network", "samples", "page_ms", "alone_ms", "gflops", "difference")
    names = ("network", "samples", "as the page, ms", "dispatches, ms", "GFLOP/s", "largest difference")
    return [*lines, *table(names, ([step[column] for column in columns] for step in found.get("steps", [])))]


def gpu_page(stages: Stages, note: str = "") -> list[str]:
    """Format the page about everything, with a note beneath its head."""
    of = {name: stage["results"] for name, stage in stages.items()}
    machine = of.get("machine", {})
    lines = ["# On a GPU", "", "Measured by `benchmarks/on_gpu.py`, written by `benchmarks/results_of_gpu.py`.", ""]
    lines += [f"{describe(machine)}. float32 products by cuBLAS: {machine.get('float32_tflops')} TFLOP/s.", ""]
    lines += [note, ""] if note else []
    lines += ["## Goals", *table(("goal", "measured", ""), goals(stages))]
    lines += [
        "layered has the plain schedule and takes every ray to its end; fused is relaxed.",
        "",
        "The extrapolation assumes that the shader uses the same share of either card's float32 rate; the measured "
        "card's is first multiplied by the share that its fragment shaders get.",
        "",
        "## CUDA",
        "",
        "PSNR, dB, against the GLSL renderer's picture, 256 x 256, one ray per pixel.",
    ]
    checks = of.get("check", {}).get("checks", [])
    of_way = {(c["model"], c["schedule"], c["variant"]): c["psnr"] for c in checks}
    drawn = dict.fromkeys(way[:2] for way in of_way)
    variants = ("simple", "fused", "layered")
    rows = ((*case, *(of_way.get((*case, variant)) for variant in variants)) for case in drawn)
    lines += table(("model", "schedule", *variants), rows)
    sanitized = of.get("sanitizer", {})
    if isinstance(tools := sanitized.get("tools", sanitized.get("missing")), str):
        lines += [tools, ""]
    else:
        lines += table(
            ("compute-sanitizer", "exit code", "last line"), ((t["tool"], t["exit"], t["said"]) for t in tools or ())
        )
    kernels = of.get("counters", {}).get("kernels", {})
    rows = (
        (name.split("(")[0], *(metrics.get(metric) for metric in KERNEL_METRICS)) for name, metrics in kernels.items()
    )
    lines += ["Counters of the kernels of one frame of (64, 2) > (128, 2) > (256, 2), fused:"]
    lines += table(("kernel", *KERNEL_METRICS), rows)
    lines += glsl_section(of.get("glsl", {}))
    lines += [
        "## Training",
        "",
        "Two devices train at once, on half of the cores each. Seconds: to the mean |f| with which the CPU ends.",
    ]
    runs = [run for shape in ("armadillo", "lucy") for run in of.get(shape, {}).get("runs", [])]
    lines += table(
        ("shape", "preset", "device", "steps", "mean abs f", "angle, degrees", "seconds"),
        [row for shape in ("armadillo", "lucy") for row in training_rows([r for r in runs if r["shape"] == shape])],
    )
    lines += wgsl_section(of.get("wgsl", {}))
    lines += browser_lines(of.get("page", {}))
    return lines


def browser_lines(found: dict[str, Any]) -> list[str]:
    """Format the section of the stage `page`."""
    lines = ["## Pages in headless Chromium", "", found.get("missing", "" if "tried" in found else "Not measured.")]
    for tried in found.get("tried", []):
        gpu = tried["webgpu"] or {"vendor": "none"}
        webgpu = " ".join(filter(None, (gpu.get(key) for key in ("vendor", "architecture", "description"))))
        lines.append(f"{tried['way']}: WebGL: {tried['webgl']}; WebGPU: {webgpu}.")
    lines += [
        "",
        "Seconds to a picture, and to the refined one. Turntable: pictures per second, with the pixels that the page "
        "chooses, and with all.",
    ]
    keys = ("page", "width", "height", "drawn", "still", "fps_auto", "pixels_auto", "fps_1", "storage")
    names = (
        "page",
        "width",
        "height",
        "picture, s",
        "refined, s",
        "per second",
        "pixels",
        "per second, all",
        "weights",
    )
    lines += table(names, ([entry[key] for key in keys] for entry in found.get("pages", [])))
    lines += [
        "The studio trains its first example: on the GPU, where that is faster after 20 steps of both, and by the "
        "workers alone. Difference: the largest relative one of a loss."
    ]
    columns = ("gpu", "workers", "gpu_ms", "workers_ms", "difference")
    recorded = [(training, all(map(is_trained, training["stages"]))) for training in found.get("trainings", [])]
    trainings = [training for training, is_whole in recorded if is_whole]
    failed = [training for training, is_whole in recorded if not is_whole]
    rows = (
        (training["with"], number, *(stage[column] for column in columns))
        for training in trainings
        for number, stage in enumerate(training["stages"], 1)
    )
    lines += table(("with", "stage", "steps: GPU", "workers", "ms a step: GPU", "workers", "difference"), rows)
    lines += [f"- {training['with']}: {training['said']}" for training in trainings]
    lines += [f"- {training['with']}: not measured, since a stage of the training had no step." for training in failed]
    return [*lines, ""]


def is_trained(stage: dict[str, Any]) -> bool:
    """Whether a stage of a training in the page has steps; without them its figures are no result."""
    return bool(stage["gpu"] + stage["workers"] > 0)


def describe(machine: dict[str, Any]) -> str:
    """Describe the machine in a line."""
    return ", ".join(str(machine.get(name, "")).replace("\n", ", ") for name in ("software", "gpu", "nvcc"))


def main() -> None:
    """Write the pages."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+", metavar="FOLDER")
    parser.add_argument("--pages", type=Path, default=Path(__file__).parents[1] / "docs" / "results")
    parser.add_argument("--note", default="", help="a paragraph beneath the head of gpu.md")
    options = parser.parse_args()
    stages = merged(json.loads((folder / REPORT).read_text(encoding="utf-8")) for folder in options.folders)
    pages = {"gpu.md": "\n".join(gpu_page(stages, options.note))}
    if stages.get("table2", {}).get("results", {}).get("rows"):
        machine = describe(stages.get("machine", {}).get("results", {}))
        pages["table2.md"] = "\n".join(table2_page(stages["table2"]["results"], machine))
    for name, text in pages.items():
        (options.pages / name).write_text(text.rstrip() + "\n", encoding="utf-8")
        print(options.pages / name)


if __name__ == "__main__":
    main()
