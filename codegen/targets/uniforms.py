"""The table of uniforms: what a fragment shader, the page and CUDA are told from outside.

GLSL declares them from it, and the page's settings, CUDA's arguments and the window's panel take their defaults there.
Not in it are uniforms of single files in glsl/, which declare them themselves, and which are 0 unless they are set:
`plain` (base_colour.glsl), `split` (worn_level.glsl, mesh.glsl), the grid of cells (skip.glsl), what passes of a frame
leave to others (`rays`, `normals`, `floor_light` with `floor_corner`), `first` (normals.glsl, traced.glsl), and those
that place a mesh (mesh.vert.glsl).
"""

from dataclasses import dataclass

SHADINGS = ("phong", "normal", "depth", "steps", "texture", "studio", "data")
"""The shading modes: the index of each is its value of the uniform `shading` (glsl/shadings.glsl)."""

OPENING_SHADES = ("studio", "phong")
"""Shading modes that a page or a text of Shadertoy may open in; the first one by default."""

SCHEDULES = ("plain", "relaxed")
"""The schedules of sphere tracing: the index of each is its value of the uniform `schedule` (glsl/schedules.glsl)."""

LEVELS = "LEVELS"
"""Stands for a default that depends on the model: its number of levels."""
GROUND = "GROUND"
"""Stands for another one: the height of the shape's lowest point, model space, y up."""


@dataclass(frozen=True)
class Uniform:
    """A value that a baked program takes from outside, the same by name in every target."""

    type: str
    """GLSL type: float, int, vec2, vec3 or mat4; of one element where `per_level` is set."""
    name: str
    """The same in GLSL, in CUDA and in the page's scripts."""
    default: tuple[float, ...] | str | None
    """Numbers, one for all components or one for each (a mat4's column by column); or LEVELS or GROUND; or None, where
    each level of the model has its own."""
    meaning: str
    """What it is, with its unit or space, on one line."""
    per_level: bool = False
    """Whether it is an array with one element for each level."""

    @property
    def declared(self) -> str:
        """The name as GLSL declares it, with the length of an array."""
        return f"{self.name}[{LEVELS}]" if self.per_level else self.name

    def glsl_default(self) -> str | None:
        """Return the default as a GLSL expression, or None where each level of the model has its own."""
        if self.default is None or isinstance(self.default, str):
            return self.default
        numbers = ", ".join(f"{number:g}" for number in self.default)
        if self.type == "float" and "." not in numbers:
            numbers += "."
        return numbers if self.type in ("float", "int") else f"{self.type}({numbers})"


UNIFORMS = (
    Uniform("vec2", "resolution", (512,), "size of the image, pixels; the one to set"),
    Uniform("vec2", "origin", (0,), "of this tile inside the image, pixels"),
    Uniform("vec2", "jitter", (0,), "of the sample inside its pixel, pixels, [-0.5, 0.5)"),
    Uniform(
        "mat4",
        "camera",
        (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 3.4, 1),
        "camera to model space: columns right, up, back, eye",
    ),
    Uniform("float", "focal", (2.75,), "1 / tan(fov / 2), vertical"),
    Uniform("int", "level", LEVELS, "level that is traced"),
    Uniform("int", "normal_level", LEVELS, "level whose gradient is the normal"),
    Uniform("int", "iterations", None, "sphere tracing steps at each level, per round", per_level=True),
    Uniform("int", "rounds", (64,), "how often the levels are gone through"),
    Uniform("float", "delta", None, "half width of each level's band, model units", per_level=True),
    Uniform("float", "step_bound", None, "factor on each level's steps where it is the one traced", per_level=True),
    Uniform("float", "band_step_bound", None, "the same where a finer level is traced", per_level=True),
    Uniform("float", "step_scale", (1,), "another factor on every step; below 1: safer, slower"),
    Uniform("int", "schedule", (1,), "how rays are traced: 0 plain, 1 relaxed"),
    Uniform(
        "int",
        "shading",
        (0,),
        "0 Phong, 1 normal, 2 depth, 3 steps, 4 texture, 5 studio, 6 data: (t, steps, level, hit)",
    ),
    Uniform("float", "ground", GROUND, "height of the floor that shading 5 shows, model space, y up"),
    Uniform("vec3", "light", (-0.5, 0.7, 0.8), "direction to the light, camera space"),
    Uniform("vec3", "background_bottom", (0.13, 0.14, 0.17), "sRGB"),
    Uniform("vec3", "background_top", (0.33, 0.36, 0.41), "sRGB"),
)
"""All uniforms but TIME, in the order in which a shader declares them."""

TIME = Uniform("float", "time", (0,), "moment of a model that moves, from 0 to 1")
"""The uniform that is declared beside them where the field is one of (x, y, z, t)."""


def uniform(name: str) -> Uniform:
    """Return the uniform of a name. Raises KeyError where there is none."""
    return {entry.name: entry for entry in (*UNIFORMS, TIME)}[name]


def default(name: str) -> tuple[float, ...]:
    """Return the numbers of a uniform's default.

    Raises KeyError where there is no such uniform, and TypeError where the default depends on the model.
    """
    numbers = uniform(name).default
    if not isinstance(numbers, tuple):
        raise TypeError(f"the default of {name} depends on the model")
    return numbers
