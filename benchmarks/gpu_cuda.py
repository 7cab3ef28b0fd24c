"""Stages of on_gpu.py that run the CUDA programs: pictures, compute-sanitizer, Table 2, counters."""

import csv
import io
import json
import re
import shutil
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from gpu_commands import PACK, REHEARSAL, run
from gpu_programs import CHECKED, PROGRAMS, build, is_built
from stages import Results
from table2 import ROWS

CAMERA = "30,20"
"""View of the pictures: `mplicits render` begins with the model's own front, a CUDA program with this."""
VARIANTS = (("relaxed", "simple"), ("relaxed", "fused"), ("plain", "simple"), ("plain", "fused"), ("plain", "layered"))
"""Schedule, variant."""
FRAMES = {"simple": 5, "fused": 100, "layered": 2}
"""Frames that are timed; `simple` and `layered` take up to 0.6 s for one on an H200."""
PEAKS = (2, 16) if REHEARSAL else (4096, 8192)
"""Amounts of work by which the card's peak rates are measured: rounds of mma, side of cuBLAS's matrices."""


def way(schedule: str, variant: str) -> tuple[str, ...]:
    """Return a program's first arguments, by which it draws so; `layered` knows only the plain schedule."""
    return ("layered",) if variant == "layered" else ("--schedule", schedule, "--variant", variant)


def check(results: Results) -> None:
    """Build all CUDA programs, and compare every variant with a reference picture."""

    def timed(name: str) -> dict[str, Any]:
        began = time.perf_counter()
        try:
            build(name)
        except SystemExit as failed:
            return {"model": name, "error": str(failed)}
        return {"model": name, "seconds": round(time.perf_counter() - began, 1)}

    names = CHECKED[:1] if REHEARSAL else PROGRAMS
    with ThreadPoolExecutor(1 if REHEARSAL else 8) as pool:
        for built in pool.map(timed, names):
            results.add("errors" if "error" in built else "builds", built)
    side = 40 if REHEARSAL else 256
    for name in filter(is_built, CHECKED):
        reference = PACK / "pictures" / f"{name}-{side}.ppm"
        for schedule, variant in VARIANTS:
            picture = results.folder / f"{name}-{variant}-{schedule}.ppm"
            options = (*way(schedule, variant), "--size", side, "--camera", CAMERA, "-o", picture)
            done = run(build(name), *options, "--check", reference, "--psnr", 30)
            found = re.search(r"PSNR ([-\d.]+) dB", done.stdout)
            decibels = float(found[1]) if found else None
            entry = {"model": name, "schedule": schedule, "variant": variant, "psnr": decibels}
            if found:
                results.add("checks", entry)
            else:
                results.add("errors", entry | {"error": done.stdout[-300:]})


def sanitizer(results: Results) -> None:
    """Run compute-sanitizer on fused."""
    if shutil.which("compute-sanitizer") is None:
        results.set("missing", "compute-sanitizer is not installed")
        return
    draw = (build("spot"), "--variant", "fused", "--size", 128, "-o", results.folder / "sanitized.ppm")
    for tool in ("memcheck", "racecheck", "synccheck", "initcheck"):
        done = run("compute-sanitizer", "--tool", tool, "--error-exitcode", 9, *draw, timeout=25)
        said = (done.stdout.strip().splitlines() or [""])[-1]
        results.add("tools", {"tool": tool, "exit": done.returncode, "said": said})


def table2(results: Results) -> None:
    """Time every row of Table 2 by both schedules, and compare the frames of fused with those of simple."""
    side, peaks = 12 if REHEARSAL else 512, dict[str, float]()
    for title, name, (level, normal_level), _ in reversed(ROWS[1:3] if REHEARSAL else ROWS):
        try:
            program = build(name)
            peaks = peaks or json.loads(run(program, "peaks", *PEAKS, timeout=60, check=True).stdout)
        except SystemExit as failed:
            results.add("errors", {"model": name, "said": str(failed)})
            continue
        results.set("peaks", peaks)
        view = ("--size", side, "--level", level, "--normal-level", normal_level, "-o", results.folder / f"{name}.ppm")
        for schedule, variant in VARIANTS:
            frames = 1 if REHEARSAL else FRAMES[variant]
            options = (*way(schedule, variant), *view, "--benchmark", "--frames", frames)
            done = run(program, *options, timeout=60)
            if done.returncode:
                results.add("errors", {"model": name, "variant": variant, "said": done.stdout[-300:]})
                continue
            for row in json.loads(done.stdout)["sizes"][0]["variants"]:
                entry = {"row": title, "schedule": schedule} | row
                if "useful_tflops" in row:
                    entry["useful_share"] = round(row["useful_tflops"] / max(peaks.values()), 4)
                if variant == "fused":
                    simple = results.folder / f"{name}-simple-{side}.ppm"
                    compared = run(program, *view, "--schedule", schedule, "--check", simple, "--psnr", 0)
                    found = re.search(r"PSNR ([-\d.]+) dB", compared.stdout)
                    entry["psnr"] = float(found[1]) if found else None
                results.add("rows", entry)
        if name != "three":
            for picture in results.folder.glob(f"{name}*.ppm"):
                picture.unlink()


def counters(results: Results) -> None:
    """Read Nsight Compute's counters of the kernels of a frame of the largest model."""
    if shutil.which("ncu") is None:
        results.set("ncu", "Nsight Compute is not installed")
        return
    draw = (build("three"), "--variant", "fused", "--size", 512, "-o", results.folder / "counted.ppm")
    done = run("ncu", "--set", "full", "--csv", "--page", "details", "--clock-control", "none", *draw, timeout=60)
    (results.folder / "counters.csv").write_text(done.stdout, encoding="utf-8")
    lines = done.stdout.splitlines()
    first = next((i for i, line in enumerate(lines) if line.startswith('"ID"')), len(lines))
    kernels: dict[str, dict[str, str]] = {}
    for row in csv.DictReader(io.StringIO("\n".join(lines[first:]))):
        if row.get("Metric Name"):
            kernel = kernels.setdefault(f"{row['ID']} {row['Kernel Name']}", {})
            kernel[row["Metric Name"]] = f"{row['Metric Value']} {row['Metric Unit']}".strip()
    results.set("kernels", kernels)
    if not kernels:
        results.add("errors", {"ncu": done.stdout[-300:]})
