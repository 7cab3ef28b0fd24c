"""The table of uniforms: the inputs of a fragment shader, of the page and of CUDA.

GLSL's declarations and the defaults of the page, CUDA and the window come from it. Single files in glsl/ declare
further uniforms, which are 0 unless set: `plain` (base_color.glsl), `split` (normal_level_at.glsl, mesh.glsl), the
grid of cells (skip.glsl), the results of earlier passes (`rays`, `normals`, `floor_light` with `floor_corner`),
`newton` (gradient.glsl, trace_with_normal.glsl), and the placement of a mesh (mesh.vert.glsl).
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Shading:
    """A shading mode, whose color glsl/functions/shade.glsl computes."""

    name: str
    """For `--shade` and uniforms; in capitals, after SHADE_, that of its value in glsl/functions/shadings.glsl."""
    label: str = ""
    """On the page's button and in lists of keys; "" for raw data, which is no picture."""
    key: str = ""
    """In the window; in small letters, in the page. s saves a picture in both."""


SHADING_TABLE = (
    Shading("phong", "Phong", "P"),
    Shading("normal", "Normals", "N"),
    Shading("depth", "Depth", "D"),
    Shading("steps", "Steps", "X"),
    Shading("texture", "Texture", "T"),
    Shading("softbox", "Softbox", "G"),
    Shading("data"),
)
"""The index is the value of the uniform `shading`."""

SHADINGS = tuple(shading.name for shading in SHADING_TABLE)
SHADING_PICTURES = tuple(shading for shading in SHADING_TABLE if shading.label)

OPENING_SHADES = ("softbox", "phong")
"""Shading modes that a page or a text of Shadertoy may open in; the first one by default."""

OLD_SHADES = {"studio": "softbox"}
"""Earlier name -> name; the next version drops it."""

SCHEDULES = ("plain", "relaxed")
"""Schedules of sphere tracing; the index is the value of the uniform `schedule` (glsl/functions/schedules.glsl)."""

LEVELS = "LEVELS"
"""Default that depends on the model: its number of levels."""
GROUND = "GROUND"
"""Default that depends on the model: the height of the shape's lowest point, model space, y up."""


@dataclass(frozen=True)
class Uniform:
    """An input of a baked program, with the same name in every target."""

    type: str
    """GLSL type: float, int, vec2, vec3 or mat4; the type of one element if `per_level`."""
    name: str
    default: tuple[float, ...] | str | None
    """Numbers: one for all components, or one for each (a mat4 column by column). LEVELS or GROUND. None where each
    level of the model has its own number."""
    meaning: str
    """Meaning, with unit or space, on one line."""
    per_level: bool = False
    """Whether it is an array with one element for each level."""

    @property
    def declared(self) -> str:
        """The name in GLSL's declaration, with the length of an array."""
        return f"{self.name}[{LEVELS}]" if self.per_level else self.name

    def glsl_default(self) -> str | None:
        """Return the default as a GLSL expression; None where each level of the model has its own."""
        if self.default is None or isinstance(self.default, str):
            return self.default
        numbers = ", ".join(f"{number:g}" for number in self.default)
        if self.type == "float" and "." not in numbers:
            numbers += "."
        return numbers if self.type in ("float", "int") else f"{self.type}({numbers})"


UNIFORMS = (
    Uniform("vec2", "resolution", (512,), "size of the image, pixels; set this one"),
    Uniform("vec2", "origin", (0,), "offset of this tile in the image, pixels"),
    Uniform("vec2", "jitter", (0,), "offset of the sample in its pixel, pixels, [-0.5, 0.5)"),
    Uniform(
        "mat4",
        "camera",
        (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 3.4, 1),
        "camera to model space: columns right, up, back, eye",
    ),
    Uniform("float", "focal", (2.75,), "1 / tan(fov / 2), vertical"),
    Uniform("int", "level", LEVELS, "traced level"),
    Uniform("int", "normal_level", LEVELS, "level whose gradient is the normal"),
    Uniform("int", "iterations", None, "sphere tracing steps at each level, per round", per_level=True),
    Uniform("int", "rounds", (64,), "most passes over the levels"),
    Uniform("float", "delta", None, "band half-width of each level, model units", per_level=True),
    Uniform("float", "step_bound", None, "factor on each level's steps if it is the traced level", per_level=True),
    Uniform(
        "float", "band_step_bound", None, "factor on each level's steps if a finer level is traced", per_level=True
    ),
    Uniform("float", "step_scale", (1,), "further factor on every step; below 1: safer, slower"),
    Uniform("int", "schedule", (1,), "sphere tracing: 0 plain, 1 over-relaxed"),
    Uniform(
        "int",
        "shading",
        (0,),
        ", ".join(f"{i} {name}" for i, name in enumerate(SHADINGS)) + ": (t, steps, level, hit)",
    ),
    Uniform("float", "ground", GROUND, "height of the floor of the shading softbox, model space, y up"),
    Uniform("vec3", "light", (-0.5, 0.7, 0.8), "direction to the light, camera space"),
    Uniform("vec3", "background_bottom", (0.13, 0.14, 0.17), "sRGB"),
    Uniform("vec3", "background_top", (0.33, 0.36, 0.41), "sRGB"),
)
"""All uniforms but TIME, in the order of their declarations."""

TIME = Uniform("float", "time", (0,), "time of a moving model, from 0 to 1")
"""The additional uniform of a moving field."""


def uniform(name: str) -> Uniform:
    """Return a uniform by name. Raises KeyError where there is none."""
    return {entry.name: entry for entry in (*UNIFORMS, TIME)}[name]


def default(name: str) -> tuple[float, ...]:
    """Return the numbers of a uniform's default.

    Raises KeyError for an unknown uniform, and TypeError where the default depends on the model.
    """
    numbers = uniform(name).default
    if not isinstance(numbers, tuple):
        raise TypeError(f"the default of {name} depends on the model")
    return numbers
