"""The command that measures on a GPU, without one: its runner of stages, its choice of stages, its pages."""

import importlib
import json
import sys
import tarfile
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from support import needs
from support.paths import ROOT

CASES: dict[str, tuple[float, str]] = {
    "fails": (30, "results.set('found', 1); sys.exit(3)"),
    "hangs": (1.5, "results.set('found', 2); child = subprocess.Popen(['sleep', '60']); "
                   "results.set('child', child.pid); time.sleep(60)"),
    "works": (30, "results.add('rows', {'fps': 5}); results.add('rows', {'fps': 6}); print('said')"),
    "too long": (1000, "pass"),
}  # fmt: skip
"""Name of a stage -> its limit in seconds, and its program."""


def benchmark(name: str) -> Any:
    """Import a script of benchmarks/."""
    return importlib.import_module(name)


def test_a_stage_that_fails_or_hangs_does_not_end_the_others(tmp_path: Path) -> None:
    stages, output = benchmark("stages"), tmp_path / "output"
    output.mkdir()
    head = (
        f"import subprocess, sys, time; from pathlib import Path; sys.path.insert(0, {str(ROOT / 'benchmarks')!r}); "
        "from stages import Results; results = Results(Path(sys.argv[1])); "
    )
    chosen = [
        stages.Stage(name, limit, (sys.executable, "-c", head + program)) for name, (limit, program) in CASES.items()
    ]
    report = stages.run_stages(chosen, 60, tmp_path / "scratch", output, {})
    assert [stage["status"] for stage in report.values()] == ["failed", "stopped", "done", "skipped"]
    assert report["fails"]["results"] == {"found": 1}
    assert report["hangs"]["results"]["found"] == 2
    assert 1.5 <= report["hangs"]["seconds"] < 20
    state = Path(f"/proc/{report['hangs']['results']['child']}/stat")
    assert not state.exists() or state.read_text().rpartition(")")[2].split()[0] == "Z"
    assert report["works"]["results"] == {"rows": [{"fps": 5}, {"fps": 6}]}
    assert json.loads((output / "report.json").read_text()) == report
    assert "said" in (output / "log.txt").read_text()
    with tarfile.open(output / "files.tar.gz") as archive:
        assert "works/results.json" in archive.getnames()


def test_a_browser_is_driven_through_a_pipe(tmp_path: Path) -> None:
    """It waits for promises, runs a script before the page's own, and passes errors on; its end is one."""
    program, gpu_browser = needs.program("Chromium"), benchmark("gpu_browser")
    page = tmp_path / "page.html"
    page.write_text("<!doctype html><title>plain</title><script>globalThis.seen = globalThis.early;</script>")
    flags = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
    with gpu_browser.Browser(Path(program), flags, tmp_path / "profile", {}) as browser:
        browser.open(page.as_uri(), (64, 48), "globalThis.early = 7;")
        assert browser.until("document.readyState === 'complete'", 60)
        assert browser.value("Promise.resolve([seen, innerWidth, document.title])") == [7, 64, "plain"]
        assert not browser.until("false", 0.1)
        with pytest.raises(gpu_browser.BrowserError, match="a reason"):
            browser.value("Promise.reject(new Error('a reason'))")
        browser.picture(tmp_path / "page.png")
        with Image.open(tmp_path / "page.png") as picture:
            assert picture.size == (64, 48)
        with pytest.raises(gpu_browser.BrowserError, match="has ended"):
            browser.call("Browser.crash")
