"""The stages of on_gpu.py: each is a function that runs in a process of its own and records what it finds."""

import csv
import io
import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

from stages import Results
from table2 import MODELS_OF, ROWS

ROOT = Path(__file__).parents[1]
PACK = ROOT / "out" / "gpu"
"""What pack_for_gpu.py gathers."""
REHEARSAL = "MPLICITS_REHEARSAL" in os.environ
"""Whether to run tiny cases on a CPU, with g++ in nvcc's place."""
DEVICE = "cpu" if REHEARSAL else "cuda"
MPLICITS = (sys.executable, "-m", "mplicits")
CHECKED = ("spot", "three", "spot-large")
"""Models whose CUDA programs are compared with a reference picture."""
CAMERA = "30,20"
"""Its view: `mplicits render` begins with the model's own front, a CUDA program with this."""
VARIANTS = (("relaxed", "simple"), ("relaxed", "fused"), ("plain", "simple"), ("plain", "fused"), ("plain", "layered"))
"""Schedule, variant."""
FRAMES = {"simple": 5, "fused": 100, "layered": 2}
"""Frames that are timed; `simple` and `layered` take up to 0.6 s for one on an H200."""
TRAIN_SECONDS = 40 if REHEARSAL else 60
PHOTO_SECONDS = 10 if REHEARSAL else 50
HELD_OUT, CAMERA_SIZE = 8, (1600, 1200)
"""Every eighth photograph of scan 24 is held out; the size of the pictures that its cameras are for."""


def run(*command: object, timeout: float | None = None, check: bool = False) -> subprocess.CompletedProcess[str]:
    """Run a command; print its output, and return it with both streams in stdout; 124 is the code after a timeout."""
    words = [str(word) for word in command]
    print("$", *words, flush=True)
    try:
        done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=timeout, check=False)
        code, output = done.returncode, done.stdout
    except subprocess.TimeoutExpired as late:
        code, output = 124, (late.stdout or b"") + f"\nstopped after {timeout} s".encode()
    text = output.decode("utf-8", "replace")
    print(text[-4000:], flush=True)
    if check and code:
        raise SystemExit(f"{words[0]} failed with {code}: {text[-300:]}")
    return subprocess.CompletedProcess(words, code, text)


def model_of(name: str) -> str:
    """Return the file of a model of Table 2, or the name of a model of the gallery."""
    return str(PACK / "models" / f"{name}.safetensors") if name in MODELS_OF else name


def machine(results: Results) -> None:
    """Describe the machine: the card, its drivers, tools and libraries, and the speed of a float32 product."""
    commands = {
        "gpu": "nvidia-smi --query-gpu=name,driver_version,memory.total,power.limit,clocks.max.sm --format=csv,noheader"
        " || echo none",
        "nvcc": "nvcc --version | tail -2",
        "tools": "which nvcc ncu nsys compute-sanitizer cuobjdump nvidia-smi chromium Xvfb",
        "processor": "grep -m1 'model name' /proc/cpuinfo; nproc; uname -r; free -g | head -2",
        "loaders": "ldconfig -p | grep -E 'libEGL|libGLX|libvulkan|libcublas.so|libnvidia-egl|libnvidia-gl'",
        "manifests": "find /usr /etc -name '*nvidia*.json' -path '*[ev]*' 2>/dev/null | head -20",
        "environment": "env | grep -E '^(LD_LIBRARY_PATH|__EGL|VK_|PYTHONPATH|MPLICITS)'",
        "packages": f"{sys.executable} -m pip list 2>/dev/null | grep -iE '^(torch|numpy|scipy|pillow|moderngl|wgpu) '",
    }
    for name, command in commands.items():
        results.set(name, run("sh", "-c", command).stdout.strip())
    import torch

    from protocol import machine as software

    results.set("software", software())
    side = 512 if REHEARSAL else 8192
    a = torch.rand(side, side, device=DEVICE)
    seconds = []
    for _ in range(5):
        began = time.perf_counter()
        float((a @ a)[0, 0])
        seconds.append(time.perf_counter() - began)
    results.set("float32_tflops", round(2 * side**3 / min(seconds) / 1e12, 2))


def program_of(name: str) -> Path:
    """Return where the CUDA program of a model is, or will be."""
    return Path(os.environ["MPLICITS_PROGRAMS"], name, "model")


def is_built(name: str) -> bool:
    """Whether the CUDA program of a model is there."""
    return program_of(name).exists()


def build(name: str) -> Path:
    """Bake and compile the CUDA program of a model, unless it is there. Ends the process where that fails."""
    program = program_of(name)
    if not is_built(name):
        program.parent.mkdir(parents=True, exist_ok=True)
        source, compiled = program.with_suffix(".cu"), program.with_suffix(".new")
        run(*MPLICITS, "bake", model_of(name), "--target=cuda", "--force", "-o", source, check=True)
        command = ["nvcc", "-O3", "-arch=native"]
        if REHEARSAL:
            shim = ROOT / "tests" / "support" / "cuda_on_host"
            command = ["g++", "-std=c++17", "-O1", "-w", "-DMPLICITS_HOST", f"-I{shim}", "-x", "c++"]
        run(*command, source, "-o", compiled, check=True)
        compiled.rename(program)
    return program


def check(results: Results) -> None:
    """Compile all CUDA programs, and compare every variant with a reference picture."""

    def timed(name: str) -> dict[str, Any]:
        began = time.perf_counter()
        try:
            build(name)
        except SystemExit as failed:
            return {"model": name, "error": str(failed)}
        return {"model": name, "seconds": round(time.perf_counter() - began, 1)}

    names = CHECKED[:1] if REHEARSAL else dict.fromkeys((*CHECKED, *MODELS_OF))
    with ThreadPoolExecutor(1 if REHEARSAL else 8) as pool:
        for built in pool.map(timed, names):
            results.add("errors" if "error" in built else "builds", built)
    side = 40 if REHEARSAL else 256
    for name in filter(is_built, CHECKED):
        reference = PACK / "pictures" / f"{name}-{side}.ppm"
        for schedule, variant in VARIANTS:
            picture = results.folder / f"{name}-{variant}-{schedule}.ppm"
            options = ("--schedule", schedule, "--variant", variant, "--size", side, "--camera", CAMERA, "-o", picture)
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
    side = 12 if REHEARSAL else 512
    for title, name, (level, normal_level), _ in reversed(ROWS[1:3] if REHEARSAL else ROWS):
        try:
            program = build(name)
        except SystemExit as failed:
            results.add("errors", {"model": name, "said": str(failed)})
            continue
        view = ("--size", side, "--level", level, "--normal-level", normal_level, "-o", results.folder / f"{name}.ppm")
        for schedule, variant in VARIANTS:
            frames = 1 if REHEARSAL else FRAMES[variant]
            options = ("--benchmark", "--schedule", schedule, "--variant", variant, "--frames", frames)
            done = run(program, *view, *options, timeout=60)
            if done.returncode:
                results.add("errors", {"model": name, "variant": variant, "said": done.stdout[-300:]})
                continue
            report = json.loads(done.stdout)
            results.set("peaks", {key: report[key] for key in ("peak_mma_tflops", "peak_cublas_tflops")})
            for row in report["sizes"][0]["variants"]:
                entry = {"row": title, "schedule": schedule} | row
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


def glsl(results: Results) -> None:
    """Time the window's renderer through EGL: the gallery, and literals against a texture."""
    from mplicits.codegen.targets.glsl330 import bake
    from mplicits.model.errors import UserError
    from mplicits.model.gallery import model_path
    from mplicits.model.model_file import load
    from mplicits.viewer.draw.camera import Camera
    from mplicits.viewer.draw.context import open_context
    from mplicits.viewer.draw.options import RenderOptions
    from mplicits.viewer.draw.renderer import Renderer

    context = open_context("egl")
    results.set("renderer", context.renderer)
    if context.software and not REHEARSAL:
        raise SystemExit(f"{context.renderer} is software: the driver's EGL was not found")
    sizes = [(64, 64)] if REHEARSAL else [(512, 512), (1920, 1080), (3840, 2160)]
    gallery = [(name, "auto", shade) for name in ("spot", "spot-large", "spot-small") for shade in ("studio", "phong")]
    narrow, wide = ("spot-small", "spot", "two-128"), ("two-256", "siren")  # literals 256 wide compile for minutes
    stored = [(name, storage, "phong") for name in narrow for storage in ("literal", "texture")]
    stored += [(name, "texture", "phong") for name in wide]
    for name, storage, shade in gallery[-1:] if REHEARSAL else [*gallery, *stored]:
        try:
            renderer = Renderer(context, bake(load(model_path(model_of(name))), storage, passes=True))
        except UserError as refusal:
            results.add("errors", {"model": name, "storage": storage, "said": str(refusal)})
            continue
        for width, height in sizes if storage == "auto" else sizes[:1]:
            frame = partial(renderer.timed, (width, height), Camera(aspect=width / height), RenderOptions(shade=shade))
            frame()
            end, times = time.perf_counter() + 3, [frame() for _ in range(3)]
            while len(times) < 60 and time.perf_counter() < end:
                times.append(frame())
            wall, on_card = (statistics.median(column) for column in zip(*times, strict=True))
            found = {"fps": 1 / wall, "gpu_ms": 1e3 * on_card, "compile_seconds": renderer.compile_seconds}
            case = {"model": name, "storage": storage, "shade": shade, "width": width, "height": height}
            results.add("frames", case | {key: round(value, 3) for key, value in found.items()})
        renderer.release()
    model, size = ("spot-small", "64") if REHEARSAL else ("spot", "1920x1080")
    picture = ("--shade=studio", f"--size={size}", "--context=egl", "-o", results.folder / "spot.png")
    run(*MPLICITS, "render", model, *picture)


def train(shape: str, results: Results) -> None:
    """Train a shape on the GPU and, on the other half of the cores, on the CPU, for as many seconds each."""
    mesh, cores = PACK / "data" / "meshes" / f"{shape}.ply", os.cpu_count() or 2
    halves = {DEVICE: f"0-{cores // 2 - 1}"} | ({} if REHEARSAL else {"cpu": f"{cores // 2}-{cores - 1}"})
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


def step(results: Results) -> None:
    """Time a training step beside the authors' way, and the normals of Table 9."""
    smaller = {"train_step": ("--points", 512), "table9": ("--nets", "16x2", "--side", 32)} if REHEARSAL else {}
    for name in ("train_step", "table9"):
        script, page = ROOT / "benchmarks" / f"{name}.py", results.folder / f"{name}_cuda.md"
        options = ("--device", DEVICE, "--rounds", 3, *smaller.get(name, ()))
        done = run(sys.executable, script, *options, "-o", page)
        if done.returncode:
            results.add("errors", {"script": name, "said": done.stdout[-300:]})
        else:
            results.set(page.name, page.read_text(encoding="utf-8"))


def wgsl(results: Results) -> None:
    """Evaluate the WGSL function of spot by WebGPU on Vulkan: its difference from numpy, and points per second."""
    import numpy as np
    import wgpu  # type: ignore[import-untyped]
    from wgpu.utils.compute import compute_with_buffers  # type: ignore[import-untyped]

    import mplicits

    results.set("adapters", [adapter.summary for adapter in wgpu.gpu.enumerate_adapters_sync()])
    field, count, turns = mplicits.load("spot"), 4096 if REHEARSAL else 1 << 20, 4 if REHEARSAL else 64
    points = np.random.default_rng(0).uniform(-0.7, 0.7, (count, 4)).astype(np.float32)
    main = """
@group(0) @binding(0) var<storage, read> points: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> found: array<f32>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) at: vec3u) {
    let i = at.x + at.y * 65536u; var sum = spot(points[i].xyz);
    for (var k = 1u; k < TURNS; k++) { sum += 1e-30 * spot(points[i].xyz + 1e-4 * f32(k)); }
    found[i] = sum;
}"""
    text = field.bake("wgsl", name="spot")
    groups = (min(count, 65536) // 64, -(-count // 65536), 1)
    for loops in (1, turns):
        shader = text + main.replace("TURNS", f"{loops}u")
        for _ in range(2):
            began = time.perf_counter()
            out = compute_with_buffers({0: points}, {1: (count, "f")}, shader, n=groups)
            results.set(f"seconds_{loops}", time.perf_counter() - began)
        if loops == 1:
            values = np.frombuffer(out[1], np.float32)
            results.set("largest_difference", float(np.abs(values[:4096] - field.sdf(points[:4096, :3])).max()))
    results.set("evaluations", {"1": count, str(turns): count * turns})


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


STAGES: dict[str, tuple[float, Callable[[Results], None]]] = {
    "machine": (40, machine),
    "check": (110, check),
    "table2": (150, table2),
    "glsl": (90, glsl),
    "sanitizer": (60, sanitizer),
    "armadillo": (150, partial(train, "armadillo")),
    "step": (70, step),
    "counters": (120, counters),
    "wgsl": (30, wgsl),
    "photos": (200, photos),
    "lucy": (150, partial(train, "lucy")),
}
"""Name of a stage -> time limit in seconds, function; the most valuable stage first."""
