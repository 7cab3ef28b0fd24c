"""Measures what a person waits for: every verb, cold and warm. Writes docs/results/waits.md.

    python benchmarks/waits.py [--only WORD] [--repeat 3] [-o docs/results/waits.md]

Run it on an idle machine. Each command is a process of its own, in a folder of its own.
"""

import argparse
import os
import resource
import shlex
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from mplicits.bake.registry import TARGETS
from protocol import Page, machine

ROOT = Path(__file__).parents[1]
COMMANDS = (
    "--help",
    "info spot",
    "info spot --sizes",
    "check spot.ply",
    "check spot.ply -o check.png --force",
    "train spot.ply -o one.safetensors --steps 1",
    "train spot.ply -o few.safetensors --steps 200 --preset small",
    "morph spot.ply bob.ply -o morph.safetensors --steps 1 --preset small",
    "render spot -o spot.png --force",
    "render spot -o spot.png --force --shade softbox",
    "render spot-large -o large.png --force",
    "render spot-to-bob -o moving.png --force",
    "render spot-to-bob -o moving.gif --frames 8 --size 160 --force",
    *(f"bake spot --target {name} -o baked --force" for name in TARGETS),
    "bake spot-to-bob --target html -o baked --force",
    "pack spot -o packed.safetensors --force",
    "mesh spot -o spot.glb",
    "mesh spot -o fine.glb --resolution 512",
    "eval spot spot.ply --resolution 256",
    f"compose {ROOT / 'examples/pond.toml'} -o pond.safetensors",
    "report spot -o report.html --force",
    "studio -o studio.html --force",
    "gallery site --force",
    "demo --no-window",
)
"""Every verb that waits for no one, as a person would call it; `train` with few steps, for what surrounds them."""
SHAPES = ("spot", "bob")
"""Models whose meshes the commands read."""


def waited(command: str, folder: Path, caches: Path) -> tuple[float, float, int]:
    """Run a command. Returns its wall time, the time of all processors, and its exit code.

    caches: folder of the caches of drivers and libraries.
    """
    environment = os.environ | {"XDG_CACHE_HOME": str(caches), "MESA_SHADER_CACHE_DIR": str(caches)}
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    argv = [sys.executable, "-m", "mplicits", *shlex.split(command)]
    done = subprocess.run(argv, check=False, cwd=folder, env=environment, capture_output=True)
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.returncode


def main() -> None:
    """Measure every command, and write a row for each."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", default="", metavar="WORD", help="only commands that contain it")
    parser.add_argument("--repeat", type=int, default=3, metavar="N", help="warm runs, whose median counts")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs/results/waits.md")
    options = parser.parse_args()
    page = Page(
        options.output,
        "# What a person waits for",
        "",
        f"Printed by `python benchmarks/waits.py`. {machine()}.",
        "",
        "Seconds from the command to its end. Cold: the first run, without caches of the graphics driver. Warm: the "
        f"median of {options.repeat} further runs; then seconds of all processors. Pictures are drawn by software.",
        "",
        "| mplicits ... | cold, s | warm, s | processors, s |",
        "| --- | ---: | ---: | ---: |",
    )
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for shape in SHAPES:
            waited(f"mesh {shape} -o {shape}.ply --resolution 96", folder, folder)
        for number, command in enumerate(command for command in COMMANDS if options.only in command):
            caches = folder / f"caches-{number}"
            caches.mkdir()
            cold, *more = (waited(command, folder, caches) for _ in range(1 + options.repeat))
            warm = [statistics.median(column) for column in zip(*more, strict=True)]
            failed = f" (exit code {cold[2]})" if cold[2] else ""
            shown = command.replace(f"{ROOT}/", "")
            page.add(f"| `{shown}`{failed} | {cold[0]:.1f} | {warm[0]:.1f} | {warm[1]:.1f} |")


if __name__ == "__main__":
    main()
