"""The panel: every setting of the view, what a level costs, exports; messages, progress and keys over the picture."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...codegen.targets.registry import TARGETS
from ..draw.options import SHADINGS
from ..state import jobs, overlay
from .help import FAINT, bare, place, show_keys

if TYPE_CHECKING:
    from .window import Window

WIDTH = 300
"""Of the panel, before the display's scale."""
SHOWN = tuple(name for name in SHADINGS if name != "data")
SAMPLES = (1, 4, 16, 64)
PICTURES = {
    "the window's size": None,
    "1920 x 1080": (1920, 1080),
    "3840 x 2160": (3840, 2160),
    "7680 x 4320": (7680, 4320),
}
MEASURED = 320
"""Most pixels a side of a picture that costs are measured with."""
WRONG = 0.98, 0.55, 0.48, 1.0


class Panel:
    """Draws with `imgui` what belongs to a window."""

    def __init__(self) -> None:
        self._covered: list[tuple[float, float, float, float]] = []
        self._picture = 0
        self._video = jobs.Turntable()

    def covers(self, x: float, y: float) -> bool:
        """Whether a point, window coordinates, is on what was drawn last."""
        return any(left <= x < right and top <= y < bottom for left, top, right, bottom in self._covered)

    def draw(self, imgui: Any, window: "Window", scale: float) -> None:
        """The panel and what lies over the picture. scale: of the display."""
        self._covered = []
        size = imgui.get_io().display_size
        width = WIDTH * scale
        left = width if window.desk.view.panel else 0.0
        if window.desk.view.panel:
            imgui.set_next_window_pos((0, 0))
            imgui.set_next_window_size((width, size.y))
            imgui.begin("panel", None, bare(imgui))
            imgui.push_item_width(0.52 * imgui.get_content_region_avail().x)
            self._look(imgui, window)
            self._march(imgui, window)
            self._light(imgui, window)
            self._levels(imgui, window)
            self._export(imgui, window)
            imgui.pop_item_width()
            self._cover(imgui)
            imgui.end()
        self._news(imgui, window, left, size)
        if window.desk.view.help:
            self._covered.append(show_keys(imgui, left, size))

    def _look(self, imgui: Any, window: "Window") -> None:
        clamp = imgui.SliderFlags_.always_clamp  # a number may be typed
        desk, view = window.desk, window.desk.view
        options = view.options
        level, normal_level = options.traced(view.levels)
        imgui.text(desk.source.name)
        imgui.push_style_color(imgui.Col_.text, FAINT)
        imgui.text(desk.timing)
        imgui.pop_style_color()
        imgui.separator()
        if view.levels > 1:
            changed, level = imgui.slider_int("level", level, 1, view.levels, f"%d of {view.levels}", clamp)
            if changed:
                view.set(level=level, normal_level=max(level, normal_level))
            changed, normal_level = imgui.slider_int("normals of", normal_level, 1, view.levels, "level %d", clamp)
            if changed:
                view.set(level=level, normal_level=normal_level)
            changed, split = imgui.checkbox("split view", view.split is not None)
            if changed:
                view.split, view.changed = view.levels if split else None, True
            if view.split is not None:
                changed, right = imgui.slider_int("on the right", view.split, 1, view.levels, "level %d", clamp)
                if changed:
                    view.split, view.changed = right, True
        shown = SHOWN if view.textured else tuple(name for name in SHOWN if name != "texture")
        changed, index = imgui.combo("shading", shown.index(options.shading), list(shown))
        if changed:
            view.set(shading=shown[index])
        if view.textured:
            changed, textured = imgui.checkbox("texture", not options.plain)
            if changed:
                view.set(plain=not textured)
        if desk.overlay is not None:
            changed, index = imgui.combo("mesh", overlay.SHOWN.index(view.mesh), list(overlay.SHOWN))
            if changed:
                view.mesh, view.changed = overlay.SHOWN[index], True
        changed, index = imgui.combo("samples", _nearest(SAMPLES, options.samples), [str(n) for n in SAMPLES])
        if changed:
            view.set(samples=SAMPLES[index])
        changed, resolution = imgui.slider_float("resolution", 100 * view.resolution, 12.5, 100.0, "%.0f %%", clamp)
        if changed:
            view.resolution, view.changed = min(1.0, max(0.125, resolution / 100)), True
        changed, turntable = imgui.checkbox("turntable", view.turntable)
        if changed:
            view.turntable, view.changed = turntable, True
        imgui.same_line()
        if imgui.button("reset the camera"):
            view.key("R")

    def _march(self, imgui: Any, window: "Window") -> None:
        clamp = imgui.SliderFlags_.always_clamp  # a number may be typed
        if not imgui.collapsing_header("Sphere tracing"):
            return
        desk, view = window.desk, window.desk.view
        options = view.options
        steps = list(options.steps(desk.source.shader.iterations))
        for i in range(view.levels):
            changed, value = imgui.slider_int(f"steps, level {i + 1}", steps[i], 1, 64, "%d", clamp)
            if changed:
                steps[i] = max(1, min(64, value))
                view.set(iterations=tuple(steps))
        logarithmic = clamp | imgui.SliderFlags_.logarithmic
        changed, value = imgui.slider_float("delta scale", options.delta_scale, 0.1, 10.0, "%.2f", logarithmic)
        if changed:
            view.set(delta_scale=min(10.0, max(0.1, value)))
        default = (desk.renderer.default("step_scale") or (0.8,))[0]
        changed, value = imgui.slider_float("step scale", options.step_scale or default, 0.1, 1.2, "%.2f", clamp)
        if changed:
            view.set(step_scale=min(1.2, max(0.1, value)))
        if imgui.button("defaults"):
            view.set(iterations=None, delta_scale=1.0, step_scale=None)

    def _light(self, imgui: Any, window: "Window") -> None:
        clamp = imgui.SliderFlags_.always_clamp  # a number may be typed
        if not imgui.collapsing_header("Light and background"):
            return
        view, renderer = window.desk.view, window.desk.renderer
        light = view.options.light or renderer.default("light")
        if light:
            x, y, z = light
            around, above = math.degrees(math.atan2(x, z)), math.degrees(math.atan2(y, math.hypot(x, z)))
            turned, around = imgui.slider_float("light, around", around, -180.0, 180.0, "%.0f\u00b0", clamp)
            raised, above = imgui.slider_float("light, above", above, -90.0, 90.0, "%.0f\u00b0", clamp)
            if turned or raised:
                a, e = math.radians(around), math.radians(max(-90.0, min(90.0, above)))
                view.set(light=(math.cos(e) * math.sin(a), math.sin(e), math.cos(e) * math.cos(a)))
        top, bottom = (
            list(colour)
            for colour in view.options.background
            or (renderer.default("background_top"), renderer.default("background_bottom"))
        )
        if len(top) == len(bottom) == 3:
            no_inputs = imgui.ColorEditFlags_.no_inputs
            first, top = imgui.color_edit3("background, top", top, no_inputs)
            second, bottom = imgui.color_edit3("bottom", bottom, no_inputs)
            if first or second:
                view.set(background=(tuple(top), tuple(bottom)))
        if imgui.button("defaults##light"):
            view.set(light=None, background=None)

    def _levels(self, imgui: Any, window: "Window") -> None:
        if not imgui.collapsing_header("Cost of the levels"):
            return
        desk, area = window.desk, window.area[2:]
        if desk.costs and imgui.begin_table("costs", 4):
            for title in ("level", "ms", "steps", "ended"):
                imgui.table_setup_column(title)
            imgui.table_headers_row()
            for level, cost in enumerate(desk.costs, start=1):
                for text in (f"{level}", f"{cost.milliseconds:.2f}", f"{cost.steps:.1f}", f"{100 * cost.ended:.1f} %"):
                    imgui.table_next_column()
                    imgui.text(text)
            imgui.end_table()
        if imgui.button("measure"):
            shrink = min(1.0, MEASURED / max(area))
            size = max(1, round(area[0] * shrink)), max(1, round(area[1] * shrink))

            def done(costs: list[jobs.Cost]) -> None:
                desk.costs = costs

            desk.begin(jobs.costs(desk.renderer, size, desk.view.camera, desk.view.options, done), draws=True)

    def _export(self, imgui: Any, window: "Window") -> None:
        if not imgui.collapsing_header("Export"):
            return
        desk = window.desk
        _, self._picture = imgui.combo("picture", self._picture, list(PICTURES))
        if imgui.button("save PNG"):
            window.save(list(PICTURES.values())[self._picture])
        imgui.same_line()
        if imgui.button("save turntable video"):
            window.record(self._video)
        if desk.source.model is not None:
            imgui.text("as")
            for name in ("model", *TARGETS):
                imgui.same_line()
                if imgui.get_content_region_avail().x < imgui.calc_text_size(name).x + 20:
                    imgui.new_line()
                if imgui.button(name):
                    suffix = ".safetensors" if name == "model" else TARGETS[name].suffix
                    desk.begin(jobs.target(name, desk.source.model, jobs.free_path(desk.source.name, suffix)))
        imgui.push_style_color(imgui.Col_.text, FAINT)
        imgui.text_wrapped(f"into {Path.cwd()}")
        imgui.pop_style_color()

    def _news(self, imgui: Any, window: "Window", left: float, size: Any) -> None:
        """Messages and progress, at the bottom left of the picture."""
        desk = window.desk
        if not (desk.message or desk.log or desk.job or desk.training):
            return
        imgui.set_next_window_pos((left + 12, size.y - 12), imgui.Cond_.always, (0, 1))
        imgui.set_next_window_size_constraints((0, 0), (max(80.0, size.x - left - 24), size.y - 24))
        imgui.begin("news", None, bare(imgui) | imgui.WindowFlags_.always_auto_resize)
        imgui.push_text_wrap_pos(max(60.0, size.x - left - 60))
        for line in desk.log:
            imgui.push_style_color(imgui.Col_.text, WRONG)
            imgui.text_unformatted(line)
            imgui.pop_style_color()
        if desk.training is not None:
            stage = f"{desk.training.name}: {desk.training.stage}"
            if _progress(imgui, desk.training.fraction, stage, "stop"):
                desk.stop_training()
        if desk.job is not None and _progress(imgui, *desk.doing, "cancel"):
            desk.cancel()
        if desk.message:
            imgui.text_unformatted(desk.message)
        imgui.pop_text_wrap_pos()
        self._cover(imgui)
        imgui.end()

    def _cover(self, imgui: Any) -> None:
        self._covered.append(place(imgui))


def _progress(imgui: Any, fraction: float, what: str, button: str) -> bool:
    """A bar, a line and a button that ends it; whether it was pressed."""
    imgui.text_unformatted(what)
    imgui.progress_bar(fraction, (220, 0))
    imgui.same_line()
    return bool(imgui.button(f"{button}##{button}"))


def _nearest(choices: tuple[int, ...], value: int) -> int:
    return min(range(len(choices)), key=lambda i: abs(choices[i] - value))
