"""Run stages one after the other, each in a process with a time limit, and keep what they find. Standard library only.

A stage writes into its own folder; results.json in that folder, written through `Results`, is the part that the report
repeats. A stage that fails, or that its limit stops, keeps what it has written and does not end the others.
"""

import json
import os
import signal
import subprocess
import tarfile
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

LEAST_SHARE = 0.4
"""A stage is skipped where less than this share of its limit is left."""
RESULTS, REPORT, LOG, FILES = "results.json", "report.json", "log.txt", "files.tar.gz"


@dataclass(frozen=True)
class Stage:
    """One stage: its name, its time limit in seconds, and its command line."""

    name: str
    limit: float
    command: tuple[str, ...]


class Results:
    """The results of a stage, written to its folder after every change, so that a stopped stage keeps them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._values: dict[str, Any] = {}

    def set(self, name: str, value: object) -> None:
        """Set a value."""
        self._values[name] = value
        (self.folder / RESULTS).write_text(json.dumps(self._values, indent=1), encoding="utf-8")
        print(f"{name}: {json.dumps(value)[:300]}", flush=True)

    def add(self, name: str, value: object) -> None:
        """Append a value to a list."""
        self.set(name, [*self._values.get(name, []), value])

    def check(self) -> None:
        """End the process with code 1 where the list "errors" has entries: the stage went on without their results."""
        if self._values.get("errors"):
            raise SystemExit(1)


def run_stages(
    stages: Sequence[Stage], seconds: float, scratch: Path, output: Path, environment: Mapping[str, str]
) -> dict[str, dict[str, Any]]:
    """Run stages within some seconds in all, in folders `scratch`/NAME.

    Writes three files into `output` after each stage: the report, which is returned as well (name of the stage ->
    "status", "seconds" and "results"), the end of all logs, and an archive of the stages' folders. The status is
    "done", "failed", "stopped" by the limit, or "skipped" for lack of time.
    """
    end, report = time.monotonic() + seconds, {}
    for stage in stages:
        left = end - time.monotonic()
        if left < LEAST_SHARE * stage.limit:
            report[stage.name] = {"status": "skipped", "seconds": 0.0, "results": {}}
        else:
            report[stage.name] = run_stage(stage, min(left, stage.limit), scratch / stage.name, environment)
        print(f"{stage.name}: {report[stage.name]['status']} after {report[stage.name]['seconds']:.0f} s", flush=True)
        write_report(report, scratch, output)
    return report


def run_stage(stage: Stage, limit: float, folder: Path, environment: Mapping[str, str]) -> dict[str, Any]:
    """Run one stage in `folder`, which it gets as its last argument. Kills the whole process group at the limit."""
    folder.mkdir(parents=True)
    began = time.monotonic()
    with (folder / LOG).open("wb") as log:
        process = subprocess.Popen(
            [*stage.command, str(folder)],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            env=dict(environment),
            start_new_session=True,
        )
        try:
            status = "done" if process.wait(limit) == 0 else "failed"
        except subprocess.TimeoutExpired:
            status = "stopped"
        finally:  # also what a failed stage left running
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    results = folder / RESULTS
    try:
        found = json.loads(results.read_text(encoding="utf-8")) if results.exists() else {}
    except ValueError:  # the stage was stopped while it wrote
        found = {}
    return {"status": status, "seconds": round(time.monotonic() - began, 1), "results": found}


def write_report(report: Mapping[str, object], scratch: Path, output: Path) -> None:
    """Write the three files of `run_stages`."""
    (output / REPORT).write_text(json.dumps(report, indent=1), encoding="utf-8")
    logs = [(name, scratch / name / LOG) for name in report]
    texts = [f"== {name}\n{path.read_text('utf-8', 'replace')[-20_000:]}\n" for name, path in logs if path.exists()]
    (output / LOG).write_text("".join(texts), encoding="utf-8")
    with tarfile.open(output / FILES, "w:gz", compresslevel=3) as archive:
        for name in report:
            if (scratch / name).exists():
                archive.add(scratch / name, name)
