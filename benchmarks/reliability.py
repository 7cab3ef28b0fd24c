"""Loads, renders, kills and damages without end: writes docs/results/reliability.md.

    python benchmarks/reliability.py [-o FILE] [--loads N] [--renders N] [--kills N] [--rounds N]

What is measured is what docs/reliability.md promises: memory that does not grow, training that a kill costs no more
than 30 s of, files that are whole, and one line for whatever is damaged.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from fuzz.test_fuzz import KINDS, cases
from mplicits.codegen.targets import glsl330
from mplicits.model.errors import UserError
from mplicits.model.model import load, save
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import open_osmesa
from mplicits.viewer.draw.renderer import Renderer
from protocol import Page, machine
from support.fuzzing import survive
from support.random_model import random_model

SKIPPED = 0.3
"""Share of the rounds before which memory is not looked at: caches fill."""
BALL = """import trimesh, sys; trimesh.creation.icosphere(3).export(sys.argv[1])"""


def resident() -> float:
    """Return the resident memory of this process, kB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 1024


def slope(work: Callable[[], None], count: int) -> float:
    """Do the work `count` times. Returns by how many bytes memory grows each time, of a straight line through it."""
    sizes = []
    for _ in range(count):
        work()
        sizes.append(resident())
    after = int(count * SKIPPED)
    return float(np.polyfit(np.arange(after, count), sizes[after:], 1)[0]) * 1024


def killed(folder: Path, count: int) -> tuple[int, int]:
    """Kill trainings at random times, each resumed from what the one before left.

    Returns after how many of them there was a part, and how many parts were torn.
    """
    rng = np.random.default_rng(0)
    subprocess.run([sys.executable, "-c", BALL, str(folder / "ball.ply")], check=True)
    # A part is written after every step, so that many a kill falls into the writing of one.
    code = "import sys; from mplicits import cli; from mplicits.trainer import part; part.EVERY = 0.0; cli.main()"
    argv = ["train", str(folder / "ball.ply"), "-o", str(folder / "ball.safetensors"), "--levels", "8x1,8x1"]
    found = torn = 0
    for _ in range(count):
        part = folder / "ball.part.safetensors"
        before = part.stat().st_mtime_ns if part.exists() else 0
        command = [sys.executable, "-c", code, *argv, "--steps", "300", "--resume", "--quiet"]
        with subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as process:
            until = time.monotonic() + 120
            while (not part.exists() or part.stat().st_mtime_ns == before) and time.monotonic() < until:
                time.sleep(0.01)
            time.sleep(rng.uniform(0, 0.5))
            process.kill()
        if part.exists():
            found += 1
            try:
                load(part)
            except UserError:
                torn += 1
    return found, torn


def main() -> None:
    """Parse the arguments, measure, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/results/reliability.md"))
    parser.add_argument("--loads", type=int, default=2000)
    parser.add_argument("--renders", type=int, default=100)
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--rounds", type=int, default=20, help="damaged files, times those of the fast tests")
    asked = parser.parse_args()
    page = Page(
        asked.output.absolute(),
        "# Reliability: the last figures",
        "",
        f"By `python benchmarks/reliability.py --loads {asked.loads} --renders {asked.renders} --kills {asked.kills} "
        f"--rounds {asked.rounds}` on {machine()}.",
        "",
        "| what | how often | outcome |",
        "| --- | ---: | --- |",
    )
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.chdir(folder)
        save(random_model((32, 1), (32, 1), texture=(16, 1)), folder / "m.safetensors")
        grown = slope(lambda: void(load(folder / "m.safetensors")), asked.loads)
        page.add(f"| a model is loaded | {asked.loads:,} | memory grows by {grown:.0f} bytes each time |")
        context, shader = open_osmesa(), glsl330.bake(random_model((6, 1)), "texture")

        def draw() -> None:
            renderer = Renderer(context, shader)
            renderer.render((32, 32), Camera())
            renderer.release()

        grown = slope(draw, asked.renders)
        page.add(f"| a renderer is made, draws and is released | {asked.renders:,} | {grown:.0f} bytes each time |")
        found, torn = killed(folder, asked.kills)
        page.add(
            f"| `kill -9` within 0.5 s of a part that is written after every step | {asked.kills} | "
            f"a part is there after {found}, torn: {torn} |"
        )
        seed = time.time_ns() // 1_000_000
        for kind, (use, count) in KINDS.items():
            number = asked.rounds * count
            failed = survive(cases(kind, number, seed, folder), use, folder, folder / "failed")
            page.add(f"| damaged: {kind}, seed {seed} | {number:,} | {len(failed)} end otherwise than in one line |")
    page.add("", "Not run: context losses of the page and resizes of the window in such numbers, an hour of turntable.")


def void(_: object) -> None:
    """Take what a function returns."""


if __name__ == "__main__":
    main()
