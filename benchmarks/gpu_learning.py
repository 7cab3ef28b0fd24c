"""Stages of on_gpu.py that learn: trainings, the time of a step, photographs."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from gpu_commands import DEVICE, MPLICITS, PACK, REHEARSAL, ROOT, run
from stages import Results

TRAIN_SECONDS = 40 if REHEARSAL else 60
PHOTO_SECONDS = float(os.environ.get("MPLICITS_PHOTO_SECONDS", "10" if REHEARSAL else "50"))
"""Seconds of each of the three learnings of the photographs."""
HELD_OUT, CAMERA_SIZE = 8, (1600, 1200)
"""Every eighth photograph of scan 24 is held out; the size of the pictures that its cameras are for."""


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


def measure_page(script: str, seconds: float, *options: object, results: Results) -> None:
    """Run a script of this folder that writes a page, on the GPU and within some seconds; keep what it has written."""
    page = results.folder / f"{script}_cuda.md"
    command = (sys.executable, ROOT / "benchmarks" / f"{script}.py", "--device", DEVICE, "--rounds", 3, *options)
    done = run(*command, "-o", page, timeout=4 * seconds if REHEARSAL else seconds)
    if page.exists():
        results.set(page.name, page.read_text(encoding="utf-8"))
    if done.returncode:
        results.add("errors", {"script": script, "said": done.stdout[-300:]})


def step(results: Results) -> None:
    """Time a training step beside the authors' way; most of it is three starts of PyTorch."""
    measure_page("train_step", 65, *(("--points", 512) if REHEARSAL else ()), results=results)


def normals(results: Results) -> None:
    """Time the normals of Table 9."""
    measure_page("table9", 55, *(("--nets", "16x2", "--side", 32) if REHEARSAL else ()), results=results)


def photos(results: Results) -> None:
    """Learn DTU's scan 24 at half size by `mplicits photos`, and by NeuS's network from the same rays."""
    folder, scale = PACK / "data" / "dtu_scan24", 0.1 if REHEARSAL else 0.5
    levels, omega = ("16x1", "15") if REHEARSAL else ("128x4,256x5", "15,30")
    width, rays = (64, 64) if REHEARSAL else (256, 512)
    model = results.folder / "scan24.safetensors"
    options = (f"--levels={levels}", f"--omega={omega}", f"--radiance={width}", f"--rays={rays}", f"--scale={scale}")
    view = (f"--camera-size={CAMERA_SIZE[0]}x{CAMERA_SIZE[1]}", f"--held-out={HELD_OUT}", f"--device={DEVICE}")
    done = run(*MPLICITS, "photos", folder, *options, *view, f"--seconds={PHOTO_SECONDS}", "--quiet", "-o", model)
    from mplicits.model.model_file import load

    if model.exists():
        found = load(model).provenance
        results.set("ours", {"steps": found["steps"], "psnr": found["psnr"], "seconds": found["seconds"]})
    else:
        results.add("errors", {"photos": done.stdout[-300:]})
    import torch

    from mplicits.capture.evaluation import mean_psnr
    from mplicits.capture.folder import read_photographs
    from mplicits.capture.photographs import split
    from mplicits.capture.rays import rays_of
    from mplicits.capture.rendering import Effort
    from photo_contenders import NEUS_RATE, NeusLearner, learn

    device = torch.device(DEVICE)
    learnt, held = split(read_photographs(folder, scale, CAMERA_SIZE)[0], HELD_OUT)
    for factor in (4.0, 1.0):
        neus = NeusLearner(rays_of(learnt, device)[0], rays, Effort(), width, factor * NEUS_RATE)
        steps = learn(neus, PHOTO_SECONDS, time.perf_counter)
        psnr = mean_psnr(neus.scene, held, Effort(), 0.0, device)
        results.add("neus", {"factor": factor, "steps": steps, "psnr": psnr, "seconds": PHOTO_SECONDS})
