"""Options of a picture that a renderer draws. Loads nothing heavy: the command line declares them."""

from dataclasses import dataclass

from ...codegen.targets.uniforms import OLD_SHADES, SCHEDULES, SHADINGS
from ...model.errors import UserError
from ...model.files import show_value
from ...model.options import Options, option

Color = tuple[float, float, float]
"""Red, green and blue in [0, 1], sRGB."""


@dataclass(frozen=True)
class RenderOptions(Options):
    """Options of a picture, beside its size and its camera. None stands for the shader's default."""

    level: int | None = option(None, "last level that rays trace (default: the model's last)", metavar="L")
    normal_level: int | None = option(
        None,
        "level of the normals; above --level: normal mapping, Section 3.2 (default: that of --level)",
        metavar="L",
        study=True,
    )
    shade: str = option("phong", "shading", choices=SHADINGS, old=OLD_SHADES)
    iterations: tuple[int, ...] | None = option(
        None,
        "sphere tracing steps at each level, the last for all finer ones (default: the model's)",
        metavar="20,5,5",
        least=1,
        most=10_000,
        study=True,
    )
    rounds: int | None = option(
        None, "passes through the levels (default: the shader's)", metavar="N", least=1, most=1000, study=True
    )
    schedule: str = option(
        SCHEDULES[-1], "sphere tracing as in the paper, or over-relaxed, in fewer steps", choices=SCHEDULES, study=True
    )
    delta_scale: float = option(1.0, "factor on the bands' widths", metavar="X", above=0, most=100, study=True)
    step_scale: float | None = option(
        None, "factor on the steps; below 1: safer, slower", metavar="X", above=0, most=100, study=True
    )
    plain: bool = option(False, "leave out the model's colors", study=True)
    light: Color | None = option(None, "direction to the light: right, up, to the viewer", metavar="X,Y,Z")
    background: str | tuple[Color, Color] | None = option(
        None, "one color, or two: top,bottom", metavar="#RRGGBB[,#RRGGBB]"
    )
    samples: int = option(
        1, "most rays of a pixel; pixels like their neighbors take one", metavar="N", least=1, most=256
    )
    uniform: bool = option(False, "take all samples for every pixel", study=True)
    time: float = option(0.0, "time of a model that moves, from 0 to 1", metavar="T", least=0, most=1)
    transparent: bool = False
    """Whether alpha is coverage, and the background is left out of the colors."""
    split_at: float = 0.0
    """Share of the width, from the left, that has the normals of `level`, or a mesh's own."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.light is not None and not any(self.light):
            raise UserError("--light: the direction needs a number that is not 0")
        if not 0.0 <= self.split_at <= 1.0:
            raise UserError(f"split_at {show_value(self.split_at)}: a share from 0 to 1 is needed")
        _ = self.colors

    @property
    def colors(self) -> tuple[Color, Color] | None:
        """The background's colors at the top and at the bottom. Raises UserError where a value is none."""
        if self.background is None:
            return None
        if not isinstance(self.background, str):
            if not all(0.0 <= value <= 1.0 for color in self.background for value in color):
                raise UserError(f"--background {show_value(self.background)}: numbers from 0 to 1 are needed")
            return self.background
        try:
            colors = [bytes.fromhex(part.removeprefix("#")) for part in self.background.split(",")]
        except ValueError:
            colors = []
        if len(colors) not in (1, 2) or any(len(color) != 3 for color in colors):
            raise UserError(
                f"--background {show_value(self.background)}: RRGGBB, or RRGGBB,RRGGBB for top,bottom, is needed"
            )
        top, bottom = (((r / 255, g / 255, b / 255)) for r, g, b in (colors[0], colors[-1]))
        return top, bottom

    def resolved_levels(self, levels: int) -> tuple[int, int]:
        """Return (level, normal level) in a model of `levels` levels. Raises UserError where it has no such level."""
        level = levels if self.level is None else self.level
        normal_level = level if self.normal_level is None else self.normal_level
        for name, value in (("level", level), ("normal level", normal_level)):
            if not 1 <= value <= levels:
                raise UserError(f"{name} {value}: the model has levels 1 to {levels}")
        return level, normal_level

    def check_texture(self, textured: bool) -> None:
        """Raise UserError where the shading is the texture of a model that has none."""
        if self.shade == "texture" and not textured:
            raise UserError("the model has no texture (it was trained without one); use --shade phong or normal")

    def resolved_iterations(self, defaults: tuple[int, ...]) -> tuple[int, ...]:
        """Return the iterations of each level. defaults: the model's. Raises UserError where there are too many."""
        iterations = self.iterations or defaults
        if len(iterations) > len(defaults):
            raise UserError(f"iterations: {len(iterations)} numbers for a model of {len(defaults)} levels")
        return iterations + iterations[-1:] * (len(defaults) - len(iterations))
