"""Stage of on_gpu.py that times GLSL: the window's renderer through EGL, and what the card gives fragment shaders."""

import json
import multiprocessing
import statistics
import time
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

from gpu_commands import MPLICITS, REHEARSAL, run
from gpu_programs import build, model_of
from stages import Results

LIMIT = 300 if REHEARSAL else 80
"""Seconds of the stage; what is left then is not drawn."""
COMPILE_LIMIT = 200 if REHEARSAL else 60
"""Seconds until a renderer must have compiled."""
FRAME_SECONDS = 2
"""Seconds of frames of one case, after the first one."""
HD, SMALL, LARGE = (1920, 1080), (512, 512), (3840, 2160)
FRAMES = {"simple": 5, "fused": 50}
"""Variant of CUDA -> frames."""

Case = tuple[str, str, str, tuple[int, int]]
"""Model, storage, shading, (width, height)."""


def cases() -> list[Case]:
    """Return the frames to draw, the most valuable first."""
    if REHEARSAL:
        return [("spot-small", "auto", "phong", (64, 64)), ("spot-small", "texture", "phong", (64, 64))]
    found: list[Case] = [("spot", "auto", "softbox", size) for size in (HD, SMALL)]
    found += [
        (name, storage, "phong", SMALL)
        for name in ("spot-small", "spot", "two-128")
        for storage in ("literal", "texture")
    ]
    found += [(name, "texture", "phong", SMALL) for name in ("two-256", "siren")]  # literals compile for minutes
    found += [(name, "auto", "softbox", size) for name in ("spot-small", "spot-large") for size in (HD, SMALL)]
    found += [("spot", "auto", "phong", size) for size in (HD, SMALL)]
    return found + [(name, "auto", "softbox", LARGE) for name in ("spot", "spot-small", "spot-large")]


def glsl(results: Results) -> None:
    """Measure the share of fragment shaders, spot's frame by CUDA, then frames of the renderer.

    Each renderer has a process of its own, and all compile at once; one at a time draws.
    """
    end = time.monotonic() + LIMIT
    from gpu_share import fragment_share
    from mplicits.viewer.draw.context import open_context

    context = open_context("egl")
    results.set("renderer", context.renderer)
    if context.software and not REHEARSAL:
        raise SystemExit(f"{context.renderer} is software: the driver's EGL was not found")
    context.release()
    results.set("fragment_share", fragment_share(*((64, 256) if REHEARSAL else (1024, 4096))))
    waiting, painters = cases(), {}
    for name, storage, shade, _ in waiting:
        if (name, storage) not in painters:
            painters[name, storage] = Painter(name, storage, shade)
    cuda_frames(results)
    while waiting and time.monotonic() < end:
        case = next((case for case in waiting if painters[case[:2]].is_ready()), None)
        if case is None:
            time.sleep(0.1)
            continue
        waiting.remove(case)
        name, storage, shade, size = case
        entry = {"model": name, "storage": storage, "shade": shade, "width": size[0], "height": size[1]}
        found = painters[name, storage].frames(shade, size, end - time.monotonic())
        kind = "skipped" if "late" in found else "errors" if "said" in found else "frames"
        results.add(kind, entry | found)
    for name, storage, shade, size in waiting:
        entry = {"model": name, "storage": storage, "shade": shade, "width": size[0], "height": size[1]}
        results.add("skipped", entry | {"late": f"not reached in {LIMIT} s"})
    for painter in painters.values():
        painter.end()
    model, pixels = ("spot-small", "64") if REHEARSAL else ("spot", "1920x1080")
    picture = ("--shade=softbox", f"--size={pixels}", "--context=egl", "-o", results.folder / "spot.png")
    run(*MPLICITS, "render", model, *picture, timeout=max(5.0, end - time.monotonic()))


def cuda_frames(results: Results) -> None:
    """Time spot's frame by CUDA, without the share of fragment shaders."""
    size = "12x8" if REHEARSAL else "x".join(map(str, HD))
    try:
        program = build("spot")
    except SystemExit as failed:
        results.add("errors", {"said": str(failed)})
        return
    for variant, frames in FRAMES.items():
        view = ("--size", size, "--shade", "softbox", "-o", results.folder / "spot-cuda.ppm")
        count = 1 if REHEARSAL else frames
        done = run(program, *view, "--benchmark", "--variant", variant, "--frames", count, timeout=LIMIT / 4)
        if done.returncode:
            results.add("errors", {"variant": variant, "said": done.stdout[-300:]})
            continue
        for row in json.loads(done.stdout)["sizes"][0]["variants"]:
            results.add("cuda_frames", {"size": size, **{key: row[key] for key in ("variant", "fps", "milliseconds")}})


class Painter:
    """A renderer in a process of its own, which may compile for longer than we wait."""

    def __init__(self, name: str, storage: str, shade: str) -> None:
        spawning = multiprocessing.get_context("spawn")
        self._near, far = spawning.Pipe()
        self._process = spawning.Process(target=paint, args=(far, name, storage, shade), daemon=True)
        self._process.start()
        far.close()  # so that its end is seen here
        self._due = time.monotonic() + COMPILE_LIMIT
        self._said: dict[str, Any] | None = None

    def is_ready(self) -> bool:
        """Whether the renderer has compiled, or failed, or is late."""
        if self._said is None and self._near.poll():
            self._said = self._answer(0)
        elif self._said is None and time.monotonic() > self._due:
            self._said = {"late": f"not compiled in {COMPILE_LIMIT} s"}
            self.end()
        return self._said is not None

    def frames(self, shade: str, size: tuple[int, int], seconds: float) -> dict[str, Any]:
        """Time frames, at most for some seconds. Returns the rates, or why there are none: "said", or "late"."""
        assert self._said is not None
        if "compile_seconds" not in self._said:
            return self._said
        self._near.send((shade, size))
        found = self._answer(seconds)
        if "fps" not in found:
            self._said = found
            self.end()
            return found
        return found | self._said

    def _answer(self, seconds: float) -> dict[str, Any]:
        try:
            if self._near.poll(seconds):
                answer: dict[str, Any] = self._near.recv()
                return answer
        except EOFError:
            return {"said": "the renderer's process ended"}
        return {"late": f"not drawn in {seconds:.0f} s"}

    def end(self) -> None:
        """End the process."""
        self._process.kill()


def paint(connection: Connection, name: str, storage: str, shade: str) -> None:
    """Compile a renderer, then time the frames that are asked for."""
    from mplicits.codegen.targets.glsl330 import bake
    from mplicits.model.errors import UserError
    from mplicits.model.gallery import model_path
    from mplicits.model.model_file import load
    from mplicits.viewer.draw.camera import Camera
    from mplicits.viewer.draw.context import open_context
    from mplicits.viewer.draw.options import RenderOptions
    from mplicits.viewer.draw.renderer import Renderer

    try:
        shader = bake(load(model_path(model_of(name))), storage, passes=True)
        renderer = Renderer(open_context("egl"), shader, shade)
    except UserError as refusal:
        connection.send({"said": str(refusal)})
        return
    connection.send({"compile_seconds": round(renderer.compile_seconds, 3)})
    while True:
        asked, size = connection.recv()
        frame = partial(renderer.timed, size, Camera(aspect=size[0] / size[1]), RenderOptions(shade=asked))
        frame()
        end, times = time.perf_counter() + FRAME_SECONDS, [frame()]
        while len(times) < 60 and time.perf_counter() < end:
            times.append(frame())
        wall, on_card = (statistics.median(column) for column in zip(*times, strict=True))
        connection.send({"fps": round(1 / wall, 3), "gpu_ms": round(1e3 * on_card, 3)})
