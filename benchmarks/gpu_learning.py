"""Stages of on_gpu.py that train a shape."""

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

from gpu_commands import DEVICE, MPLICITS, PACK, REHEARSAL
from stages import Results

TRAIN_SECONDS = 40 if REHEARSAL else 60


def train(shape: str, results: Results, beside: bool = True) -> None:
    """Train a shape on the GPU.

    beside: at the same time on the CPU for as many seconds, each on half of the cores; not in a rehearsal.
    """
    mesh, cores = PACK / "data" / "meshes" / f"{shape}.ply", os.cpu_count() or 2
    if beside and not REHEARSAL:
        halves = {DEVICE: f"0-{cores // 2 - 1}", "cpu": f"{cores // 2}-{cores - 1}"}
    else:
        halves = {DEVICE: f"0-{cores - 1}"}
    for preset in ("small", "base") if REHEARSAL else ("base", "paper"):
        running = {}
        for device, half in halves.items():
            name = results.folder / f"{shape}-{preset}-{device}"
            options = (f"--preset={preset}", f"--device={device}", f"--seconds={TRAIN_SECONDS}", "--texture=none")
            files = (f"--log={name}.jsonl", f"--output={name}.safetensors")
            cores_alone = ("taskset", "-c", half) if shutil.which("taskset") else ()
            command = (*cores_alone, *MPLICITS, "train", str(mesh), *options, *files, "--quiet")
            running[device] = subprocess.Popen(command)
        for device, process in running.items():
            entry = {"shape": shape, "preset": preset, "device": device, "exit": process.wait()}
            found = trained(results.folder / f"{shape}-{preset}-{device}")
            results.add("errors" if entry["exit"] else "runs", entry | found)


def trained(name: Path) -> dict[str, Any]:
    """Return what a training recorded: its levels, and the last level's mean |f| over time."""
    from mplicits.model.model_file import load

    if not name.with_suffix(".safetensors").exists():
        return {}
    provenance = load(name.with_suffix(".safetensors")).provenance
    lines = [json.loads(line) for line in name.with_suffix(".jsonl").read_text(encoding="utf-8").splitlines()]
    last = [line for line in lines if line["level"] == len(provenance["levels"]) and line.get("mean_f") is not None]
    thinned = last[:: -(len(last) // 40 + 1)][::-1]
    curve = [(round(line["seconds"], 1), line["step"], line["mean_f"]) for line in thinned]
    return {"levels": provenance["levels"], "curve": curve}
