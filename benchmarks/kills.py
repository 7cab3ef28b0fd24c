"""Processes that are killed while they train or write, and damaged files."""

import contextlib
import os
import signal
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import torch
import trimesh

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from fuzz.test_fuzz import KINDS, cases
from mplicits import cli
from mplicits.model.errors import UserError
from mplicits.model.files import write_whole
from mplicits.model.model_file import load
from mplicits.trainer import machine, part
from support.ball_training import QUICK_NUMBERS
from support.fuzzing import survive

OFTEN = 0.5
"""Seconds between two parts in every other training, in place of 30; in the others they follow upon one another."""
LONGEST = 6.0
"""Seconds after which a training is killed at the latest."""
LENGTH = 4_000_000
"""Bytes of the file that is written again and again."""
WRITES = 0.2
"""Seconds for which a process writes at the most."""
STEPS = 600
SECONDS = 16
"""Length of the trainings that are compared with ones that were cut short half-way."""


def killed(work: Callable[[], None], seconds: float) -> float | None:
    """Do the work in a process of its own, which is killed after so many seconds. Returns when, of time.time().

    None: the process was done before.
    """
    child = os.fork()
    if not child:
        try:
            with (
                open(os.devnull, "w") as nothing,
                contextlib.redirect_stdout(nothing),
                contextlib.redirect_stderr(nothing),
            ):
                work()
        finally:
            os._exit(0)
    time.sleep(seconds)
    at = time.time()
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    return at if os.WIFSIGNALED(status) else None


def trainings(count: int, folder: Path) -> str:
    """Kill trainings at random times; each goes on from what the one before left, or begins anew where that ended.

    They draw and measure less than trainings do, so that most of the kills fall into the steps.
    """
    machine.prepare(torch.device("cpu"))
    torch.set_num_threads(1)  # Threads do not survive a fork.
    rng = np.random.default_rng(0)
    trimesh.creation.icosphere(3).export(folder / "ball.ply")
    output, left = folder / "ball.safetensors", folder / "ball.part.safetensors"
    argv = ["train", str(folder / "ball.ply"), "-o", str(output), "--levels", "4x0,8x1", "--seed", "1"]
    argv += ["--steps", str(STEPS), "--resume", "--quiet"]
    found = torn = back = ended = 0
    reached, oldest = (0, 0.0), 0.0
    for number in range(count):
        every = OFTEN if number % 2 else 0.0
        before = left.stat().st_mtime if left.exists() else None

        def work(every: float = every) -> None:
            part.EVERY = every
            for module, name, number in QUICK_NUMBERS:
                setattr(module, name, number)
            cli.main(argv)

        at = killed(work, rng.uniform(0, LONGEST))
        if at is None:
            ended += 1
            torn += not whole(output)
            output.unlink(missing_ok=True)
            reached = 0, 0.0
        elif left.exists():
            found += 1
            now = progress(left)
            torn += now is None
            back += now is not None and now < reached
            reached = now or reached
            if before is not None and left.stat().st_mtime > before:
                oldest = max(oldest, at - left.stat().st_mtime - every)
    return (
        f"torn: {torn}; {found} left a part, none of which the next training refused or fell behind but {back}; "
        f"{ended} ended before they were killed; a part was at most {oldest:.1f} s older than it was to be"
    )


def resumed(count: int, folder: Path) -> str:
    """Train the built-in shape by the clock with so many seeds: twice straight through, and once ended half-way.

    They draw and measure less than trainings do, so that there are many steps in so few seconds.
    """
    machine.prepare(torch.device("cpu"))
    torch.set_num_threads(1)
    for module, name, number in QUICK_NUMBERS:
        setattr(module, name, number)
    ratios, control, steps = [], [], []
    for seed in range(count):
        argv = ["train", "demo", "--levels", "16x1,32x1", "--texture", "none", "--seconds", str(SECONDS), "--resume"]
        argv += ["--seed", str(seed), "--quiet", "-o"]
        errors = []
        for kind in ("straight", "broken", "again"):
            path = folder / f"{kind}-{seed}.safetensors"
            train = partial(cli.main, [*argv, str(path)])
            if kind == "broken":
                ended(train, SECONDS / 2)
            ended(train, None)
            levels = load(path).provenance["levels"]
            errors.append(levels[-1]["mean_f"])
            steps.append(sum(level["steps"] for level in levels))
        ratios.append(errors[1] / errors[0])
        control.append(errors[2] / errors[0])
    listed, controls = (", ".join(f"{ratio:.2f}" for ratio in found) for found in (ratios, control))
    return (
        f"ended by SIGTERM half-way through {SECONDS} s and gone on with, mean abs f is {listed} times that of a "
        f"training that was not; that of another one that was not, {controls} times; {min(steps):,} to "
        f"{max(steps):,} steps"
    )


def ended(work: Callable[[], object], seconds: float | None) -> None:
    """Do the work in a process of its own, which is asked to end after so many seconds. None: it is not."""
    child = os.fork()
    if not child:
        try:
            with open(os.devnull, "w") as nothing, contextlib.redirect_stdout(nothing):
                work()
        finally:
            os._exit(0)
    if seconds is not None:
        time.sleep(seconds)
        os.kill(child, signal.SIGTERM)
    os.waitpid(child, 0)


def progress(path: Path) -> tuple[int, float] | None:
    """Return how far a part is: its number of levels, and the share of the last one's steps. None: it is torn."""
    try:
        levels = load(path).provenance["levels"]
    except UserError:
        return None
    return len(levels), float(levels[-1]["fraction"])


def whole(path: Path) -> bool:
    """Whether a model file can be read."""
    return progress(path) is not None


def writings(count: int, folder: Path) -> str:
    """Kill processes that write a file over and over; it must be one of the two that they write."""
    rng = np.random.default_rng(0)
    contents = [bytes([byte]) * (LENGTH + byte) for byte in range(2)]
    path, torn, missing = folder / "file", 0, 0
    write_whole(path, contents[0])

    def work() -> None:
        while True:
            for content in contents:
                write_whole(path, content)

    inside = 0
    for _ in range(count):
        killed(work, rng.uniform(0, WRITES))
        missing += not path.exists()
        torn += path.exists() and path.read_bytes() not in contents
        leftovers = [other for other in folder.iterdir() if other != path]
        inside += bool(leftovers)
        for leftover in leftovers:
            leftover.unlink()
    return f"torn: {torn}; missing: {missing}; {inside} fell into the writing itself"


def damages(rounds: int, folder: Path) -> str:
    """Use damaged files of every kind, with a fresh seed."""
    seed, lines, number = time.time_ns() // 1_000_000, list[str](), 0
    for kind, (use, count) in KINDS.items():
        lines += survive(cases(kind, rounds * count, seed, folder), use, folder, folder / "failed")
        number += rounds * count
    print(*lines, sep="\n")
    return f"{number:,} cases, seed {seed}: {len(lines)} end otherwise than in one line"
