"""Measure everything that needs an NVIDIA GPU, in one command of at most nine minutes.

    python benchmarks/on_gpu.py                            # all stages, the most valuable first, as far as time allows
    python benchmarks/on_gpu.py --minutes 4 --rest REPORT  # the stages that an earlier report.json has not done
    python benchmarks/on_gpu.py table2 wgsl                # these stages
    python benchmarks/on_gpu.py --rehearse                 # tiny cases on a CPU: CUDA compiled by g++, llvmpipe

pack_for_gpu.py gathers what the machine may lack in out/gpu, and pack_browser.py the browser of the stage `page` in
out/browser; both have to travel with the checkout. Three files in FOLDER ($OUT, or out/gpu/results) hold all results
(stages.py); results_of_gpu.py turns them into pages.
"""

import argparse
import ctypes
import importlib.util
import json
import os
import sys
import tempfile
import time
import tomllib
import zipfile
from pathlib import Path

from gpu_commands import PACK, ROOT
from gpu_stages import STAGES
from stages import Results, Stage, run_stages

DRIVER = ("/usr/local/nvidia/share", "/usr/share", "/etc")
"""Folders in which the driver's manifests for the loaders of OpenGL and Vulkan may be."""
MANIFESTS = (
    ("__EGL_VENDOR_LIBRARY_FILENAMES", "glvnd/egl_vendor.d/*nvidia*.json", "libEGL_nvidia.so.0"),
    ("VK_DRIVER_FILES", "vulkan/icd.d/*nvidia*.json", "libGLX_nvidia.so.0"),
)
"""The loader's variable, where the manifest is, and the driver's library, for which one is written where none is."""
REHEARSAL_FACTOR = 4
"""Factor on all time limits of a rehearsal."""


def prepare(scratch: Path) -> dict[str, str]:
    """Unpack what the machine lacks, and return the environment of the stages."""
    site, environment = scratch / "site", dict(os.environ)
    site.mkdir()
    (site / "mplicits").symlink_to(ROOT)
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    metadata = site / f"mplicits-{version}.dist-info" / "METADATA"  # the version that results name
    metadata.parent.mkdir()
    metadata.write_text(f"Metadata-Version: 2.1\nName: mplicits\nVersion: {version}\n", encoding="utf-8")
    for wheel in sorted((PACK / "wheels").glob("*.whl")):
        name = wheel.name.split("-")[0]
        if importlib.util.find_spec({"libigl": "igl"}.get(name, name)) is None:
            zipfile.ZipFile(wheel).extractall(site)
    environment["PYTHONPATH"] = os.pathsep.join(
        filter(None, [str(site), str(ROOT / "tests"), os.environ.get("PYTHONPATH", "")])
    )
    environment["MPLICITS_DATA"], environment["MPLICITS_PROGRAMS"] = str(PACK / "data"), str(scratch / "programs")
    libraries = [] if loads("libEGL.so.1") and loads("libvulkan.so.1") else [str(PACK / "lib")]
    packages = [path for folder in sys.path for path in Path(folder).glob("nvidia/*/lib/libcublas.so.*")]
    toolkit = [path for path in Path("/usr/local").glob("cuda*/lib64/libcublas.so.*") if path.exists()]
    libraries += [str(path.parent) for path in (packages + toolkit)[:1]]
    environment["LD_LIBRARY_PATH"] = os.pathsep.join(filter(None, [*libraries, os.environ.get("LD_LIBRARY_PATH", "")]))
    for variable, pattern, library in MANIFESTS:
        found = [path for folder in DRIVER for path in Path(folder).glob(pattern)]
        if not found and loads(library):
            found = [scratch / f"{library}.json"]
            content = {"file_format_version": "1.0.0", "ICD": {"library_path": library, "api_version": "1.3.0"}}
            found[0].write_text(json.dumps(content), encoding="utf-8")
        if found:
            environment.setdefault(variable, str(found[0]))
    return environment


def loads(library: str) -> bool:
    """Whether the system has a library."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def main() -> None:
    """Run the stages, or, in a process of its own, one of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("stages", nargs="*", metavar="STAGE", help=f"default: all, {', '.join(STAGES)}")
    parser.add_argument("--minutes", type=float, default=8.8, help="time in all (default 8.8)")
    parser.add_argument("--rest", type=Path, metavar="REPORT", help="the stages that this report.json has not done")
    parser.add_argument("--rehearse", action="store_true")
    parser.add_argument("--stage", choices=STAGES, help=argparse.SUPPRESS)
    parser.add_argument("-o", "--output", type=Path, default=Path(os.environ.get("OUT", PACK / "results")))
    options = parser.parse_args()
    if options.stage:
        results = Results(options.output)
        STAGES[options.stage][1](results)
        results.check()
        return
    names = options.stages or list(STAGES)
    if options.rest:
        earlier = json.loads(options.rest.read_text(encoding="utf-8"))
        names = [name for name in names if earlier.get(name, {}).get("status") != "done"]
    if unknown := [name for name in names if name not in STAGES]:
        parser.error(f"no stage {', '.join(unknown)}; stages: {', '.join(STAGES)}")
    if not PACK.exists():
        parser.error(f"{PACK} is missing: run benchmarks/pack_for_gpu.py first")
    began, factor = time.monotonic(), REHEARSAL_FACTOR if options.rehearse else 1
    with tempfile.TemporaryDirectory() as folder:
        environment = prepare(Path(folder)) | ({"MPLICITS_REHEARSAL": "1"} if options.rehearse else {})
        command = (sys.executable, "-u", str(Path(__file__).resolve()))
        stages = [Stage(name, factor * STAGES[name][0], (*command, "--stage", name, "-o")) for name in names]
        options.output.mkdir(parents=True, exist_ok=True)
        left = 60 * factor * options.minutes - (time.monotonic() - began)
        run_stages(stages, left, Path(folder), options.output, environment)


if __name__ == "__main__":
    main()
