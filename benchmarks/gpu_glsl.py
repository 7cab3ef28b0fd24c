"""Stage of on_gpu.py that times GLSL: the window's renderer through EGL."""

import statistics
import time
from functools import partial

from gpu_commands import MPLICITS, REHEARSAL, run
from gpu_programs import model_of
from stages import Results


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
