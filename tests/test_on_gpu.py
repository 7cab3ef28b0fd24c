"""The command that measures on a GPU, without one: its runner of stages, its choice of stages, its pages."""

import importlib
import json
import subprocess
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

STEPS = [
    *(("begin", 0, 0), ("workers", 5, 4.0), ("gpu", 9, 5.0), ("workers", 12, 3.0), ("gpu", 13, 3.0), ("gpu", 15, 2.0)),
    *(("begin", 20, 0), ("workers", 25, 1.0), ("workers", 32, 1.0)),
]
"""Steps of a training in two stages: who took each, milliseconds, loss."""


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


@pytest.mark.parametrize(
    ("arguments", "said"),
    [(("check", "chek"), "no stage chek"), (("--rest", "{report}", "check", "chek"), "no stage chek")],
)
def test_an_unknown_stage_is_refused(arguments: tuple[str, ...], said: str, tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    report.write_text(json.dumps({"check": {"status": "done"}}))
    words = [argument.format(report=report) for argument in arguments]
    command = [sys.executable, str(ROOT / "benchmarks" / "on_gpu.py"), *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, said in done.stderr) == (2, True)


def row(title: str, schedule: str, variant: str, fps: float) -> dict[str, object]:
    return {"row": title, "schedule": schedule, "variant": variant, "fps": fps, "useful_share": 0.25}


def test_pages_show_the_numbers_and_the_goals(tmp_path: Path) -> None:
    results = benchmark("results_of_gpu")
    largest, siren = (benchmark("table2").ROWS[k][0] for k in (-1, 0))
    rows = [row(largest, "relaxed", "fused", 1200), row(largest, "plain", "layered", 150)]
    rows += [
        row(siren, "relaxed", "fused", 200),
        row(siren, "plain", "fused", 100),
        row(largest, "plain", "fused", 300),
    ]
    frame = {"model": "spot", "storage": "auto", "shade": "softbox", "width": 1920, "height": 1080, "fps": 400.0}
    levels = [{"steps": 100, "mean_f": 2e-4, "angle": 7.0}]
    run = {"shape": "lucy", "preset": "base", "exit": 0, "levels": levels}
    first = {
        "machine": {"gpu": "a card, 580", "nvcc": "13.0", "torch": "2.11", "float32_tflops": 50.0},
        "table2": {"rows": rows, "peaks": {"peak_mma_tflops": 600}},
        "glsl": {
            "renderer": "a card",
            "fragment_share": {"fragment_ms": 8.0, "compute_ms": 2.0, "share": 0.25},
            "frames": [frame | {"gpu_ms": 2.5, "compile_seconds": 1.0}],
            "skipped": [{"model": "two-128", "storage": "literal", "late": "not compiled in 60 s"}],
            "cuda_frames": [{"variant": "simple", "size": "1920x1080", "fps": 50, "milliseconds": 20}],
        },
        "lucy": {
            "runs": [
                run | {"device": "cuda", "curve": [[5.0, 10, 4e-4], [9.0, 50, 3e-4]]},
                run | {"device": "cpu", "curve": [[60.0, 90, 3.5e-4]]},
            ]
        },
        "sanitizer": {"missing": "compute-sanitizer is not installed"},
        "wgsl": {},
        "page": {
            "tried": [
                {"way": "Vulkan", "webgl": "a card", "webgpu": {"vendor": "maker", "architecture": "old"}},
                {"way": "EGL", "webgl": "none", "webgpu": None},
            ],
            "pages": [
                {"page": "spot", "width": 1920, "height": 1080, "drawn": 0.5, "still": None, "fps_auto": 30.0}
                | {"pixels_auto": 5000, "fps_1": 4.0, "storage": "literal"}
            ],
            "trainings": [
                {"with": "WebGPU", "said": "Trained in 10 s", "stages": benchmark("gpu_page").stages_of(STEPS)},
                {"with": "workers", "said": "Trained in 13 s, off by 9.4e-2", "stages": [{"gpu": 0, "workers": 0}]},
            ],
        },
    }
    step = {"network": "64x2", "samples": 4096, "page_ms": 2.5, "alone_ms": 0.5, "gflops": 800.0, "difference": 1e-6}
    reports: list[dict[str, Any]] = [
        {name: {"status": "done", "seconds": 1.0, "results": found} for name, found in first.items()},
        {"wgsl": {"status": "done", "seconds": 2.0, "results": {"adapters": ["a card via Vulkan"], "steps": [step]}}},
        {"wgsl": {"status": "skipped", "seconds": 0.0, "results": {}}},
    ]
    folders = [tmp_path / str(k) for k in range(len(reports))]
    for folder, report in zip(folders, reports, strict=True):
        folder.mkdir()
        (folder / "report.json").write_text(json.dumps(report))
    command = [sys.executable, results.__file__, *map(str, folders), "--pages", str(tmp_path), "--note", "A remark."]
    subprocess.run(command, check=True, capture_output=True)
    page = (tmp_path / "gpu.md").read_text()
    assert f"| {largest}, frames per second at 512 x 512 | 1200 | reached: at least 1000 |" in page
    assert "| its ratio to the (256, 4) SIREN, drawn the same way | 6 | reached: at least 5 |" in page
    assert "| the same ratio, both by the plain schedule | 3 | MISSED: at least 5 |" in page
    assert "\n\nA remark.\n\n## Goals" in page
    assert "| its ratio to layered | 8 | MISSED: at least 10 |" in page
    assert "extrapolated) | 64 | reached: at least 60 |" in page  # 400 frames per second by 2 of 0.25 * 50 TFLOP/s
    assert "Share of the card that fragment shaders get: 0.25. The same loop takes 2 ms" in page
    assert "Without a frame: two-128, literal, not compiled in 60 s." in page
    assert "| 64x2 | 4096 | 2.5 | 0.5 | 800 | 1e-06 |" in page
    assert "| simple | 1920x1080 | 50 | 20 |" in page
    assert "| lucy | base | cuda | 100 | 0.0002 | 7 | 9 |" in page
    assert "Vulkan: WebGL: a card; WebGPU: maker old." in page
    assert "EGL: WebGL: none; WebGPU: none." in page
    assert "| spot | 1920 | 1080 | 0.5 |  | 30 | 5000 | 4 | literal |" in page
    assert "| WebGPU | 1 | 3 | 2 | 2 |  | 0.25 |" in page
    assert "| WebGPU | 2 | 0 | 2 |  | 7 |  |" in page
    assert "- WebGPU: Trained in 10 s" in page
    assert "Trained in 13 s" not in page, "a training without steps is no result"
    assert "- workers: not measured" in page
    assert "compute-sanitizer is not installed" in page
    assert f"| {largest} | 70 |  | 1200 |  | 300 | 150 |" in (tmp_path / "table2.md").read_text()


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
