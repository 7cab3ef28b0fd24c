"""Seeded damage to files and command lines, and a process of its own that a case may bring down."""

import faulthandler
import io
import json
import os
import resource
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from random import Random
from typing import Any

from mplicits.model.errors import UserError

SECONDS = 20
"""Processor's seconds that a case may take."""
PATIENCE = 10
"""Seconds by the clock for each of these: a case that waits for ever takes no processor."""
MEMORY = 2 << 30
"""Bytes that a case may take beside what the process has."""
ODD = [b"", b"\xff", *b"nan inf 1e400 -1 0 4294967295 99999999999999999999 1e-320 { //".split()]
"""What a number in a file is replaced with."""
ODD_JSON: list[Any] = [
    None,
    True,
    -1,
    0,
    0.5,
    1e308,
    10**400,
    float("nan"),
    "",
    "\u202e\n\x1b[2J",
    "x" * 5000,
    [],
    [[]],
    {},
]

Case = tuple[str, bytes]
"""The name of a file, and what is in it."""


def fresh_seed() -> int:
    """Return a new seed, or that of MPLICITS_FUZZ_SEED, and print it."""
    seed = int(os.environ.get("MPLICITS_FUZZ_SEED") or time.time_ns() // 1_000_000)
    print(f"MPLICITS_FUZZ_SEED={seed}")
    return seed


def damaged(data: bytes, random: Random) -> bytes:
    """Damage some bytes in one to three ways."""
    for _ in range(random.randint(1, 3)):
        data = random.choice((_cut, _flipped, _number, _copied, _lost, _filled))(data, random)
    return data


def damaged_model(data: bytes, random: Random) -> bytes:
    """Damage a safetensors file: its bytes, or a value somewhere in the JSON of its header, or of its description."""
    if random.random() < 0.3:
        return damaged(data, random)
    end = 8 + int.from_bytes(data[:8], "little")
    header = json.loads(data[8:end])
    if random.random() < 0.6:
        description = json.loads(header["__metadata__"]["model"])
        _change(description, random)
        header["__metadata__"]["model"] = json.dumps(description)
    else:
        _change(header, random)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    return len(text).to_bytes(8, "little") + text + data[end:]


def _change(value: Any, random: Random) -> None:
    """Change one value somewhere inside of a JSON object or list."""
    if isinstance(value, dict | list) and value:
        keys = list(value) if isinstance(value, dict) else range(len(value))
        key = random.choice(list(keys))
        inner = value[key]
        if isinstance(inner, dict | list) and inner and random.random() < 0.7:
            _change(inner, random)
        elif isinstance(value, dict) and random.random() < 0.2:
            del value[key]
        else:
            value[key] = random.choice(ODD_JSON)


def _cut(data: bytes, random: Random) -> bytes:
    return data[: random.randrange(len(data) + 1)]


def _flipped(data: bytes, random: Random) -> bytes:
    flipped = bytearray(data)
    for _ in range(random.randint(1, 8)):
        if flipped:
            flipped[random.randrange(len(flipped))] ^= 1 << random.randrange(8)
    return bytes(flipped)


def _number(data: bytes, random: Random) -> bytes:
    """Replace a word of the file."""
    words = data.split(b" ")
    words[random.randrange(len(words))] = random.choice(ODD)
    return b" ".join(words)


def _copied(data: bytes, random: Random) -> bytes:
    start, length, place = random.randrange(len(data) + 1), random.randint(1, 200), random.randrange(len(data) + 1)
    return data[:place] + data[start : start + length] * random.randint(1, 3) + data[place:]


def _lost(data: bytes, random: Random) -> bytes:
    start = random.randrange(len(data) + 1)
    return data[:start] + data[start + random.randint(1, 200) :]


def _filled(data: bytes, random: Random) -> bytes:
    start, length = random.randrange(len(data) + 1), random.choice((1, 2, 4, 8, 64))
    return data[:start] + random.choice((b"\0", b"\xff", b"\x7f"))[:1] * length + data[start + length :]


def survive(cases: Iterable[Case], use: Callable[[Path], object], folder: Path, failures: Path) -> list[str]:
    """Use files of which each may raise a UserError of one line, and nothing else, within limits of time and memory.

    A process of its own goes on after the case that ended the one before. folder: where the files are written.
    failures: where those that failed are kept. Returns a line for each of these.
    """
    left, found = list(cases), list[str]()
    while (failed := _run(left, use, folder)) is not None:
        name, reason, done = failed
        failures.mkdir(parents=True, exist_ok=True)
        shutil.copy(folder / name, failures / name)
        found.append(f"{failures / name}: {reason}")
        left = left[done:]
    return found


def _run(cases: list[Case], use: Callable[[Path], object], folder: Path) -> tuple[str, str, int] | None:
    """Use the files in a child process. Returns the name of one that failed, why, and how many were done; or None."""
    reader, writer = os.pipe()
    child = os.fork()
    if not child:
        os.close(reader)
        with os.fdopen(writer, "w", buffering=1) as report:
            os._exit(_use_all(cases, use, folder, report))
    os.close(writer)
    with os.fdopen(reader) as report:
        lines = report.read().splitlines()
    _, status = os.waitpid(child, 0)
    if not status:
        return None
    name, *reason = lines[-1].split("\t")
    ended = f"ended by {signal.Signals(status & 127).name}" if status & 127 else "failed"
    return name, reason[0] if reason else ended, [line.split("\t")[0] for line in lines].index(name) + 1


def _use_all(cases: list[Case], use: Callable[[Path], object], folder: Path, report: io.TextIOBase) -> int:
    """Use the files one after another, in the child. Returns the exit code."""
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    faulthandler.disable()  # pytest's, which would print a stack on its own output
    if "torch" in sys.modules:  # Threads do not survive a fork, and a product of several would wait for them.
        sys.modules["torch"].set_num_threads(1)
    for name, data in cases:
        (folder / name).write_bytes(data)
        report.write(f"{name}\n")
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        signal.alarm(PATIENCE * SECONDS)
        try:
            with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
                use(folder / name)
        except UserError as error:
            if len(str(error).splitlines()) == 1 and str(error).isprintable():
                continue
            report.write(f"{name}\tnot one printable line: {str(error)[:200]!r}\n")
            return 1
        except BaseException as error:
            where = traceback.extract_tb(error.__traceback__)[-1]
            report.write(f"{name}\t{type(error).__name__} in {where.filename}:{where.lineno}\n")
            return 1
        (folder / name).unlink()
    return 0
