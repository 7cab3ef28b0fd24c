"""The panel: every setting of the view, what a level costs, exports; messages, progress and keys over the picture."""

import math
from pathlib import Path
from typing import Any

from ...bake.registry import TARGETS
from ...codegen.targets.uniforms import SHADINGS, default
from ..state.desk import Desk
from ..state.exports import record_video, save_picture, save_target
from ..state.jobs import LevelTiming, Video, time_levels
from ..state.overlay import MESH_MODES
from ..state.view import View
from .help import show_keys
from .parts import FAINT, WIDTH, Place, bare, place, tip

PANEL_SHADINGS = tuple(name for name in SHADINGS if name != "data")
"""Choices of the shading, in the order of the table."""
SAMPLES = (1, 4, 16, 64)
"""Choices of the rays per pixel."""
PICTURE_SIZES = {
    "the window's size": None,
    "1920 x 1080": (1920, 1080),
    "3840 x 2160": (3840, 2160),
    "7680 x 4320": (7680, 4320),
}
"""Choice -> (width, height) of a saved picture in pixels; None: as the window has it."""
TIMED_SIDE = 320
"""Pixels per side, at most, of the pictures that levels are timed with."""
WRONG = 0.98, 0.55, 0.48, 1.0
"""RGBA of a driver's log."""


class Panel:
    """Draws the panel and what lies over the picture with `imgui`, and does what the user asks for there."""

    def __init__(self) -> None:
        self._covered: list[Place] = []
        """Of each ImGui window of the frame that is being made."""
        self._picture_size = 0
        """Index into PICTURE_SIZES."""

    def draw(self, imgui: Any, desk: Desk, area: tuple[int, int], scale: float) -> list[Place]:
        """Draw the panel, if it is open, and what lies over the picture; return the places that these cover.

        area: (width, height) of the picture, in framebuffer pixels. scale: of the display.
        """
        view = desk.shown.view
        self._covered = []
        size = imgui.get_io().display_size
        width = WIDTH * scale
        left = width if view.panel else 0.0
        if view.panel:
            imgui.set_next_window_pos((0, 0))
            imgui.set_next_window_size((width, size.y))
            imgui.begin("panel", None, bare(imgui))
            imgui.push_item_width(0.52 * imgui.get_content_region_avail().x)
            self._look(imgui, desk)
            self._march(imgui, desk)
            self._light(imgui, desk)
            self._levels(imgui, desk, area)
            self._export(imgui, desk, area)
            imgui.pop_item_width()
            self._cover(imgui)
            imgui.end()
        self._news(imgui, desk, left, size)
        if view.help:
            self._covered.append(show_keys(imgui, left, size))
        return self._covered

    def _look(self, imgui: Any, desk: Desk) -> None:
        clamp = imgui.SliderFlags_.always_clamp  # A number may be typed.
        view, source = desk.shown.view, desk.shown.source
        options = view.options
        imgui.text(source.name)
        imgui.push_style_color(imgui.Col_.text, FAINT)
        imgui.text(desk.drawing.timing)
        imgui.pop_style_color()
        imgui.separator()
        if view.levels > 1:
            self._traced(imgui, view)
        shadings = [name for name in PANEL_SHADINGS if view.textured or name != "texture"]
        changed, index = imgui.combo("shading", shadings.index(options.shade), shadings)
        if changed:
            view.set(shade=shadings[index])
        if view.textured:
            changed, textured = imgui.checkbox("texture", not options.plain)
            if changed:
                view.set(plain=not textured)
        if desk.shown.overlay is not None:
            changed, index = imgui.combo("mesh", MESH_MODES.index(view.mesh), list(MESH_MODES))
            if changed:
                view.mesh, view.changed = MESH_MODES[index], True
        changed, index = imgui.combo("samples", _nearest(SAMPLES, options.samples), [str(n) for n in SAMPLES])
        tip(imgui, "Rays per pixel of the picture at rest: more make smoother edges, and take longer.")
        if changed:
            view.set(samples=SAMPLES[index])
        changed, resolution = imgui.slider_float("resolution", 100 * view.resolution, 12.5, 100.0, "%.0f %%", clamp)
        tip(imgui, "Pixels that are drawn along each side, as a share of the window's.")
        if changed:
            view.resolution, view.changed = min(1.0, max(0.125, resolution / 100)), True
        if view.moves:
            self._motion(imgui, view)
        changed, turntable = imgui.checkbox("turntable", view.turntable)
        if changed:
            view.turntable, view.changed = turntable, True
        imgui.same_line()
        if imgui.button("reset the camera"):
            view.key("R")

    def _motion(self, imgui: Any, view: View) -> None:
        changed, time = imgui.slider_float("time", view.options.time, 0.0, 1.0, "%.3f", imgui.SliderFlags_.always_clamp)
        tip(imgui, "The moment that is seen, from 0 to 1.")
        if changed:
            view.seek(min(1.0, max(0.0, time)))
        if imgui.button("pause##motion" if view.playing else "play##motion"):
            view.key("SPACE")
        tip(imgui, "Plays the motion there and back (Space).")
        imgui.same_line()

    def _traced(self, imgui: Any, view: View) -> None:
        clamp = imgui.SliderFlags_.always_clamp  # A number may be typed.
        level, normal_level = view.options.resolved_levels(view.levels)
        changed, level = imgui.slider_int("level", level, 1, view.levels, f"%d of {view.levels}", clamp)
        tip(imgui, "The last level that is traced: 1 is coarse, the last one is the shape.")
        if changed:
            view.set(level=level, normal_level=max(level, normal_level))
        changed, normal_level = imgui.slider_int("normals of", normal_level, 1, view.levels, "level %d", clamp)
        tip(imgui, "The level whose gradient gives the normals: a fine one's details on a coarse one's shape.")
        if changed:
            view.set(level=level, normal_level=normal_level)
        changed, split = imgui.checkbox("split view", view.split is not None)
        if changed:
            view.split, view.changed = view.levels if split else None, True
        if view.split is not None:
            changed, right = imgui.slider_int("on the right", view.split, 1, view.levels, "level %d", clamp)
            if changed:
                view.split, view.changed = right, True

    def _march(self, imgui: Any, desk: Desk) -> None:
        clamp = imgui.SliderFlags_.always_clamp  # A number may be typed.
        if not imgui.collapsing_header("Sphere tracing"):
            return
        shown, view = desk.shown, desk.shown.view
        options = view.options
        steps = list(options.resolved_iterations(shown.source.shader.iterations))
        for i in range(view.levels):
            changed, value = imgui.slider_int(f"steps, level {i + 1}", steps[i], 1, 64, "%d", clamp)
            tip(imgui, "Steps along a ray at this level, before it goes on with the next.")
            if changed:
                steps[i] = max(1, min(64, value))
                view.set(iterations=tuple(steps))
        logarithmic = clamp | imgui.SliderFlags_.logarithmic
        changed, value = imgui.slider_float("delta scale", options.delta_scale, 0.1, 10.0, "%.2f", logarithmic)
        tip(imgui, "Factor on the width of the bands in which finer levels are evaluated.")
        if changed:
            view.set(delta_scale=min(10.0, max(0.1, value)))
        step_scale = options.step_scale or (shown.renderer.default("step_scale") or default("step_scale"))[0]
        changed, value = imgui.slider_float("step scale", step_scale, 0.1, 1.2, "%.2f", clamp)
        tip(imgui, "Factor on the steps along rays: below 1 safer and slower, above 1 rays may miss thin parts.")
        if changed:
            view.set(step_scale=min(1.2, max(0.1, value)))
        if imgui.button("defaults"):
            view.set(iterations=None, delta_scale=1.0, step_scale=None)

    def _light(self, imgui: Any, desk: Desk) -> None:
        clamp = imgui.SliderFlags_.always_clamp  # A number may be typed.
        if not imgui.collapsing_header("Light and background"):
            return
        view, renderer = desk.shown.view, desk.shown.renderer
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

    def _levels(self, imgui: Any, desk: Desk, area: tuple[int, int]) -> None:
        if not imgui.collapsing_header("Cost of the levels"):
            return
        shown = desk.shown
        if shown.level_timings and imgui.begin_table("costs", 4):
            for title in ("level", "ms", "steps", "ended"):
                imgui.table_setup_column(title)
            imgui.table_headers_row()
            for level, timing in enumerate(shown.level_timings, start=1):
                milliseconds, steps = f"{timing.milliseconds:.2f}", f"{timing.steps:.1f}"
                for text in (f"{level}", milliseconds, steps, f"{100 * timing.ended:.1f} %"):
                    imgui.table_next_column()
                    imgui.text(text)
            imgui.end_table()
        measure = imgui.button("measure")
        tip(imgui, "Draws the picture up to each level: milliseconds, steps of a ray, and rays that ended there.")
        if measure:
            shrink = min(1.0, TIMED_SIDE / max(area))
            size = max(1, round(area[0] * shrink)), max(1, round(area[1] * shrink))

            def done(timings: list[LevelTiming]) -> None:
                shown.level_timings = timings

            job = time_levels(shown.renderer, size, shown.view.camera, shown.view.options, done)
            desk.work.begin(job, draws=True)

    def _export(self, imgui: Any, desk: Desk, area: tuple[int, int]) -> None:
        if not imgui.collapsing_header("Export"):
            return
        _, self._picture_size = imgui.combo("picture", self._picture_size, list(PICTURE_SIZES))
        if imgui.button("save PNG"):
            save_picture(desk, list(PICTURE_SIZES.values())[self._picture_size] or area)
        imgui.same_line()
        if imgui.button("save a video of the motion" if desk.shown.view.moves else "save turntable video"):
            record_video(desk, area, Video())
        if desk.shown.source.model is not None:
            imgui.text("as")
            for name in ("model", *TARGETS):
                imgui.same_line()
                if imgui.get_content_region_avail().x < imgui.calc_text_size(name).x + 20:
                    imgui.new_line()
                if imgui.button(name):
                    save_target(desk, name)
        imgui.push_style_color(imgui.Col_.text, FAINT)
        imgui.text_wrapped(f"into {Path.cwd()}")
        imgui.pop_style_color()

    def _news(self, imgui: Any, desk: Desk, left: float, size: Any) -> None:
        """Draw the messages and the progress of the work at the bottom left of the picture."""
        work = desk.work
        if not (desk.message or desk.log or work.job or work.training):
            return
        imgui.set_next_window_pos((left + 12, size.y - 12), imgui.Cond_.always, (0, 1))
        imgui.set_next_window_size_constraints((0, 0), (max(80.0, size.x - left - 24), size.y - 24))
        imgui.begin("news", None, bare(imgui) | imgui.WindowFlags_.always_auto_resize)
        imgui.push_text_wrap_pos(max(60.0, size.x - left - 60))
        for line in desk.log:
            imgui.push_style_color(imgui.Col_.text, WRONG)
            imgui.text_unformatted(line)
            imgui.pop_style_color()
        if work.training is not None:
            stage = f"{work.training.name}: {work.training.stage}"
            if _progress(imgui, work.training.fraction, stage, "stop"):
                work.stop_training()
        if work.job is not None and _progress(imgui, *work.job_progress, "cancel"):
            work.cancel()
        if desk.message:
            imgui.text_unformatted(desk.message)
        imgui.pop_text_wrap_pos()
        self._cover(imgui)
        imgui.end()

    def _cover(self, imgui: Any) -> None:
        """Remember the place of the ImGui window that is being made."""
        self._covered.append(place(imgui))


def _progress(imgui: Any, fraction: float, line: str, button: str) -> bool:
    """Draw a line, a bar and a button that ends the work; return whether the button was pressed."""
    imgui.text_unformatted(line)
    imgui.progress_bar(fraction, (220, 0))
    imgui.same_line()
    return bool(imgui.button(f"{button}##{button}"))


def _nearest(choices: tuple[int, ...], value: int) -> int:
    """Return the index of the choice that is nearest to the value."""
    return min(range(len(choices)), key=lambda i: abs(choices[i] - value))
