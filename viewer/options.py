"""Options of `render` and `view`. Loads nothing heavy: the command line declares them."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..codegen.targets.orbit import AZIMUTH, ELEVATION, FOV
from ..codegen.targets.samples import SHARE
from ..codegen.targets.uniforms import OLD_SHADES, SHADING_PICTURES
from ..model.endings import MESH_NAMES
from ..model.errors import UserError
from ..model.options import Options, option
from ..model.references import follow_option
from .draw.options import RenderOptions
from .draw.tiles import check_size

if TYPE_CHECKING:
    from .draw.camera import Camera

SHADES = tuple(shading.name for shading in SHADING_PICTURES)
"""The shadings that are pictures: all but "data"."""


@dataclass(frozen=True)
class CameraOptions(Options):
    """Size and camera of a picture."""

    size: int | str | tuple[int, int] = option(512, "pixels, WxH or N", metavar="WxH")
    camera: tuple[float, float] | tuple[float, float, float] | None = option(
        None,
        "degrees around, degrees above, distance in radii of the shape "
        f"(default: {AZIMUTH:g},{ELEVATION:g}, or the front that the model names; the shape fits)",
        metavar="AZ,EL,DIST",
    )
    fov: float = option(FOV, "vertical field of view, degrees")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_size(self.pixels)
        if self.camera is not None and len(self.camera) not in (2, 3):
            raise UserError("--camera: azimuth and elevation are needed, and a distance may follow")

    @property
    def pixels(self) -> tuple[int, int]:
        """Width and height. Raises UserError where the text is not a size."""
        if isinstance(self.size, tuple):
            return self.size
        text = str(self.size)
        width, by, height = text.lower().partition("x")
        if not width.isdecimal() or bool(by) != height.isdecimal() or len(text) > 20:
            raise UserError(f"--size {text!r}: WxH in pixels, for example 640x480, or N for a square, is needed")
        return int(width), int(height or width)

    def view_from(self, front: tuple[float, float] | None) -> "Camera":
        """Return the camera. front: azimuth and elevation that the model names. Raises UserError."""
        from .draw.camera import Camera

        azimuth, elevation, *distance = self.camera or front or (AZIMUTH, ELEVATION)
        width, height = self.pixels
        return Camera(azimuth, elevation, distance[0] if distance else None, fov=self.fov, aspect=width / height)


@dataclass(frozen=True)
class ViewerOptions(RenderOptions, CameraOptions):
    """Options that `render` and `view` share."""

    shade: str = option("phong", "shading", choices=SHADES, old=OLD_SHADES)
    samples: int = option(
        16, "most rays of a pixel; pixels like their neighbors take one", metavar="N", least=1, most=256
    )
    mesh: str | Path | None = option(
        None,
        f"mesh ({MESH_NAMES}) to draw in place of the model, with the normals of --normal-level",
        metavar="LOW.ply",
    )
    space: str | None = option(
        None,
        "coordinates of --mesh: those of the model's shape, or of the unit sphere (default: input)",
        choices=("input", "model"),
    )
    storage: str = option(
        "auto", "how the shader holds the weights", choices=("auto", "literal", "texture"), study=True
    )
    follow: bool = follow_option()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.mesh is None and self.space is not None:
            raise UserError("--space: of the mesh's coordinates; it needs --mesh")

    def check_time(self, name: str, moving: bool) -> None:
        """Raise UserError where --time is set for a model that does not move."""
        if self.time and not moving:
            raise UserError(f"--time: {name} does not move")


@dataclass(frozen=True)
class PictureOptions(ViewerOptions):
    """Options of a picture, for `render` and for Python (docs/viewer.md)."""

    context: str = option(
        "auto",
        "OpenGL context: egl (a GPU, else software), osmesa (software), window (hidden); auto: the first that works",
        choices=("auto", "osmesa", "egl", "window"),
        study=True,
    )
    transparent: bool = option(False, "leave out the background: alpha is coverage")
    split: bool = option(
        False,
        "left half: normals of --level, or the mesh's own; right half: normals of --normal-level "
        "(default: level 1, and the last one)",
        study=True,
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        flags = self.changed("level", "iterations", "rounds", "step_scale", "delta_scale")
        if self.mesh is not None and (flags or self.shade == "steps"):
            raise UserError(
                f"{flags or '--shade steps'}: --mesh traces no rays; --normal-level chooses the mesh's normals"
            )

    def rays(self) -> int:
        """Return about how many rays the picture takes."""
        width, height = self.pixels
        share = 1.0 if self.uniform or self.mesh is not None else SHARE
        return round(width * height * (1 + share * (self.samples - 1)))

    def for_levels(self, levels: int) -> "PictureOptions":
        """Return the options for a model with `levels` levels, with the halves of --split chosen. Raises UserError."""
        if not self.split:
            return self
        options = replace(self, split_at=0.5)
        if self.mesh is None:
            if self.level is None and self.normal_level is None:
                options = replace(options, level=1, normal_level=levels)
            level, normal_level = options.resolved_levels(levels)
            if level == normal_level:
                raise UserError(f"--split: both halves would have the normals of level {level}; choose another --level")
        return options
