"""The panel: settings, cost of the levels, exports; and messages, progress and keys over the picture."""

import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from ...bake.registry import TARGETS
from ...codegen.targets.uniforms import SHADING_PICTURES, default
from ..state.exports import record_video, save_picture, save_target
from ..state.jobs import LevelTiming, time_levels
from ..state.overlay import MESH_MODES
from ..state.view import KEYS, View
from ..state.viewer import Viewer
from .gui import TEXT, WIDTH, Place, bare_flags, begin_bare

SAMPLES = ("1", "4", "16", "64")
"""Choices of the rays per pixel."""
PICTURE_SIZES = {
    "the window's size": None,
    "1920 x 1080": (1920, 1080),
    "3840 x 2160": (3840, 2160),
    "7680 x 4320": (7680, 4320),
}
"""Choice -> (width, height) of a saved picture, pixels; None: the window's."""
TIMED_SIDE = 320
"""Largest side of the pictures that time the levels, pixels."""
FAINT, ERROR = (0.60, 0.62, 0.66, 1.0), (0.98, 0.55, 0.48, 1.0)
"""RGBA of secondary text, and of the driver's complaints."""
TIP_WIDTH = 22
"""Of a tooltip, in font heights."""


class Panel:
    """Draws the panel and the texts over the picture with Dear ImGui, and applies the user's input."""

    def __init__(self, imgui: Any, viewer: Viewer) -> None:
        self._imgui, self._viewer = imgui, viewer
        self._covered: list[Place] = []
        self._picture_size = next(iter(PICTURE_SIZES))

    def draw(self, area: tuple[int, int], scale: float) -> list[Place]:
        """Draw everything, and return the places that it covers.

        area: (width, height) of the picture, framebuffer pixels. scale: of the display.
        """
        imgui, view = self._imgui, self._viewer.view
        self._covered = []
        size = imgui.get_io().display_size
        if view.panel:
            imgui.set_next_window_pos((0, 0))
            imgui.set_next_window_size((WIDTH * scale, size.y))
            imgui.begin("panel", None, bare_flags(imgui))
            imgui.push_item_width(0.52 * imgui.get_content_region_avail().x)
            self._draw_picture_settings(view)
            for title, section in (
                ("Sphere tracing", self._draw_tracing),
                ("Light and background", self._draw_light),
                ("Cost of the levels", self._draw_costs),
                ("Export", self._draw_export),
            ):
                if imgui.collapsing_header(title):
                    section(view, area)
            imgui.pop_item_width()
            self._end()
        left = WIDTH * scale if view.panel else 0.0
        self._draw_messages(left, size)
        if view.help:
            begin_bare(imgui, "keys", ((left + size.x) / 2, size.y / 2), (0.5, 0.5))
            self._table("keys", KEYS)
            self._end()
        return self._covered

    def _draw_picture_settings(self, view: View) -> None:
        imgui, viewer, options = self._imgui, self._viewer, view.options
        imgui.text(viewer.source.name)
        imgui.text_colored(FAINT, viewer.drawing.timing)
        imgui.separator()
        if view.levels > 1:
            self._draw_levels(view)
        shadings = [each.name for each in SHADING_PICTURES if view.textured or each.name != "texture"]
        self._combo("shading", shadings, options.shade, lambda name: view.set(shade=name))
        if view.textured:
            self._checkbox("texture", not options.plain, lambda textured: view.set(plain=not textured))
        if viewer.overlay is not None:
            self._combo("mesh", MESH_MODES, view.mesh, lambda mode: view.change(mesh=mode))
        samples = min(SAMPLES, key=lambda choice: abs(int(choice) - options.samples))
        self._combo("samples", SAMPLES, samples, lambda choice: view.set(samples=int(choice)))
        self._tip("Rays per pixel of the picture at rest: more make smoother edges, and take longer.")
        resolution = 100 * view.resolution
        self._slider(
            "resolution", resolution, (12.5, 100.0), "%.0f %%", lambda share: view.change(resolution=share / 100)
        )
        self._tip("Pixels that are drawn along each side, as a share of the window's.")
        if view.moves:
            self._slider("time", options.time, (0.0, 1.0), "%.3f", view.seek)
            self._tip("The moment of the motion, from 0 to 1.")
            if imgui.button("pause##motion" if view.playing else "play##motion"):
                view.key("SPACE")
            self._tip("Plays the motion there and back (Space).")
            imgui.same_line()
        self._checkbox("turntable", view.turntable, lambda turntable: view.change(turntable=turntable))
        imgui.same_line()
        if imgui.button("reset the camera"):
            view.key("R")

    def _draw_levels(self, view: View) -> None:
        level, normal_level = view.options.resolved_levels(view.levels)
        bounds, of_levels = (1, view.levels), f"%d of {view.levels}"
        self._slider("level", level, bounds, of_levels, lambda n: view.set(level=n, normal_level=max(n, normal_level)))
        self._tip("The last level that is traced: 1 is coarse, the last one is the shape.")
        self._slider("normals of", normal_level, bounds, "level %d", lambda n: view.set(level=level, normal_level=n))
        self._tip("The level whose gradient gives the normals: details of a fine level on a coarse shape.")
        is_split = view.split is not None
        self._checkbox("split view", is_split, lambda split: view.change(split=view.levels if split else None))
        if view.split is not None:
            self._slider("on the right", view.split, bounds, "level %d", lambda n: view.change(split=n))

    def _draw_tracing(self, view: View, _area: tuple[int, int]) -> None:
        viewer, options = self._viewer, view.options
        steps = options.resolved_iterations(viewer.source.shader.iterations)

        def set_steps(i: int, count: int) -> None:
            view.set(iterations=(*steps[:i], count, *steps[i + 1 :]))

        for i in range(view.levels):
            self._slider(
                f"steps, level {i + 1}",
                steps[i],
                (1, 64),
                "%d",
                partial(set_steps, i),
            )
            self._tip("Steps along a ray at this level, before the next level.")
        self._slider(
            "delta scale", options.delta_scale, (0.1, 10.0), "%.2f", lambda x: view.set(delta_scale=x), logarithmic=True
        )
        self._tip("Factor on the width of the bands in which finer levels are evaluated.")
        step_scale = options.step_scale or (viewer.renderer.default("step_scale") or default("step_scale"))[0]
        self._slider("step scale", step_scale, (0.1, 1.2), "%.2f", lambda x: view.set(step_scale=x))
        self._tip("Factor on the steps along rays: below 1 safer and slower; above 1 rays may miss thin parts.")
        if self._imgui.button("defaults"):
            view.set(iterations=None, delta_scale=1.0, step_scale=None)

    def _draw_light(self, view: View, _area: tuple[int, int]) -> None:
        imgui, renderer = self._imgui, self._viewer.renderer
        light = view.options.light or renderer.default("light")
        if light:
            x, y, z = light
            around, above = math.degrees(math.atan2(x, z)), math.degrees(math.atan2(y, math.hypot(x, z)))

            def aim(around: float, above: float) -> None:
                a, e = math.radians(around), math.radians(above)
                view.set(light=(math.cos(e) * math.sin(a), math.sin(e), math.cos(e) * math.cos(a)))

            self._slider("light, around", around, (-180.0, 180.0), "%.0f\u00b0", lambda angle: aim(angle, above))
            self._slider("light, above", above, (-90.0, 90.0), "%.0f\u00b0", lambda angle: aim(around, angle))
        top, bottom = view.options.colors or (
            renderer.default("background_top"),
            renderer.default("background_bottom"),
        )
        if len(top) == len(bottom) == 3:
            no_inputs = imgui.ColorEditFlags_.no_inputs
            first, new_top = imgui.color_edit3("background, top", list(top), no_inputs)
            second, new_bottom = imgui.color_edit3("bottom", list(bottom), no_inputs)
            if first or second:
                view.set(background=(tuple(new_top), tuple(new_bottom)))
        if imgui.button("defaults##light"):
            view.set(light=None, background=None)

    def _draw_costs(self, view: View, area: tuple[int, int]) -> None:
        imgui, viewer = self._imgui, self._viewer
        if viewer.level_timings:
            rows = [
                (f"{level}", f"{timing.milliseconds:.2f}", f"{timing.steps:.1f}", f"{100 * timing.ended:.1f} %")
                for level, timing in enumerate(viewer.level_timings, start=1)
            ]
            self._table("costs", [("level", "ms", "steps", "ended"), *rows])
        measure = imgui.button("measure")
        self._tip("Draws the picture up to each level: milliseconds, steps per ray, and share of rays that end there.")
        if measure:
            shrink = min(1.0, TIMED_SIDE / max(area))
            size = max(1, round(area[0] * shrink)), max(1, round(area[1] * shrink))

            def done(timings: list[LevelTiming]) -> None:
                viewer.level_timings = timings

            viewer.work.begin(time_levels(viewer.renderer, size, view.camera, view.options, done), draws=True)

    def _draw_export(self, view: View, area: tuple[int, int]) -> None:
        imgui, viewer = self._imgui, self._viewer

        def set_size(name: str) -> None:
            self._picture_size = name

        self._combo("picture", list(PICTURE_SIZES), self._picture_size, set_size)
        if imgui.button("save PNG"):
            save_picture(viewer, PICTURE_SIZES[self._picture_size] or area)
        imgui.same_line()
        if imgui.button("save a video of the motion" if view.moves else "save turntable video"):
            record_video(viewer, area)
        if viewer.source.model is not None:
            imgui.text("as")
            for name in ("model", *TARGETS):
                imgui.same_line()
                if imgui.get_content_region_avail().x < imgui.calc_text_size(name).x + 20:
                    imgui.new_line()
                if imgui.button(name):
                    save_target(viewer, name)
        imgui.push_style_color(imgui.Col_.text, FAINT)
        imgui.text_wrapped(f"into {Path.cwd()}")
        imgui.pop_style_color()

    def _draw_messages(self, left: float, size: Any) -> None:
        """Draw messages and progress at the picture's bottom left. left: of the picture; size: of the window."""
        imgui, viewer, work = self._imgui, self._viewer, self._viewer.work
        if not (viewer.message or viewer.log or work.job or work.training):
            return
        imgui.set_next_window_size_constraints((0, 0), (max(80.0, size.x - left - 24), size.y - 24))
        begin_bare(imgui, "messages", (left + 12, size.y - 12), (0, 1))
        imgui.push_text_wrap_pos(max(60.0, size.x - left - 60))
        imgui.push_style_color(imgui.Col_.text, ERROR)
        for line in viewer.log:
            imgui.text_unformatted(line)
        imgui.pop_style_color()
        if work.training is not None:
            stage = f"{work.training.name}: {work.training.stage}"
            if self._progress(work.training.fraction, stage, "stop"):
                work.stop_training()
        if work.job is not None and self._progress(*work.job_progress, "cancel"):
            work.cancel()
        if viewer.message:
            imgui.text_unformatted(viewer.message)
        imgui.pop_text_wrap_pos()
        self._end()

    def _progress(self, fraction: float, line: str, button: str) -> bool:
        """Draw a line, a bar and a button; return whether the button is pressed."""
        self._imgui.text_unformatted(line)
        self._imgui.progress_bar(fraction, (220, 0))
        self._imgui.same_line()
        return bool(self._imgui.button(f"{button}##{button}"))

    def _slider(
        self,
        label: str,
        value: float,
        bounds: tuple[float, float],
        text: str,
        apply: Callable[[Any], None],
        logarithmic: bool = False,
    ) -> None:
        """Draw a slider of an int or a float, and pass a new value to `apply`. text: the value's format."""
        flags = self._imgui.SliderFlags_
        draw = self._imgui.slider_int if isinstance(value, int) else self._imgui.slider_float
        clamp = flags.always_clamp | (flags.logarithmic if logarithmic else 0)  # the user may type a number
        changed, value = draw(label, value, *bounds, text, clamp)
        if changed:
            apply(min(bounds[1], max(bounds[0], value)))

    def _combo(self, label: str, choices: Sequence[str], choice: str, apply: Callable[[str], None]) -> None:
        changed, index = self._imgui.combo(label, choices.index(choice), list(choices))
        if changed:
            apply(choices[index])

    def _checkbox(self, label: str, value: bool, apply: Callable[[bool], None]) -> None:
        changed, value = self._imgui.checkbox(label, value)
        if changed:
            apply(value)

    def _table(self, name: str, rows: Sequence[Sequence[str]]) -> None:
        """Draw rows of texts, all but the first column faint."""
        imgui = self._imgui
        if imgui.begin_table(name, len(rows[0]), imgui.TableFlags_.sizing_fixed_fit):
            for row in rows:
                for i, text in enumerate(row):
                    imgui.table_next_column()
                    imgui.text_colored((*TEXT, 1.0) if i == 0 else FAINT, text)
            imgui.end_table()

    def _tip(self, text: str) -> None:
        """Explain the last control to a pointer that rests on it."""
        if self._imgui.begin_item_tooltip():
            self._imgui.push_text_wrap_pos(TIP_WIDTH * self._imgui.get_font_size())
            self._imgui.text_unformatted(text)
            self._imgui.pop_text_wrap_pos()
            self._imgui.end_tooltip()

    def _end(self) -> None:
        """End an ImGui window, and store its place."""
        (x, y), (width, height) = self._imgui.get_window_pos(), self._imgui.get_window_size()
        self._covered.append((x, y, x + width, y + height))
        self._imgui.end()
