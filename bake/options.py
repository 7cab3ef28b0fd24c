"""Options of `bake`."""

from dataclasses import dataclass
from pathlib import Path

from ..codegen.targets.uniforms import OLD_SHADES, OPENING_SHADES
from ..model.bits import AUTOMATIC
from ..model.options import Options, option
from .registry import DEFAULT, TARGETS

_FUNCTIONS = ", ".join(name for name, target in TARGETS.items() if target.function)
_STUDIO = ", ".join(name for name, target in TARGETS.items() if target.studio)
_MARCH = ", ".join(name for name, target in TARGETS.items() if target.march)
_OPENING = ", ".join(name for name, target in TARGETS.items() if target.shaded)


@dataclass(frozen=True)
class BakeOptions(Options):
    """Options of `bake`, for the command line and for Python (docs/targets.md)."""

    target: str = option(DEFAULT, f"what to write: {', '.join(TARGETS)}", choices=tuple(TARGETS), metavar="TARGET")
    path: str | Path | None = option(
        None,
        "file to write (the command line's default: M's name and the target's ending)",
        metavar="FILE",
        flags=("-o", "--output"),
    )
    storage: str = option(
        "auto",
        "how weights are stored; auto: literals up to 64 wide, a texture above; "
        "shadertoy: packed in the fewest bits that keep the picture",
        choices=("auto", "literal", "texture", "packed"),
        study=True,
    )
    digits: int | None = option(None, "decimals of the weights, 0 to 9 (default: all)", metavar="N", least=0, most=9)
    precision: str = option(
        "float32",
        "float16 rounds the weights, and prints what that costs; pages have 16 bits anyway, where that keeps the field",
        choices=("float32", "float16"),
        excludes="digits",
        study=True,
    )
    name: str | None = option(None, f"name of the function ({_FUNCTIONS}; default: made from the model's name)")
    space: str | None = option(
        None,
        f"space of the function's points ({_FUNCTIONS}): model, where the shape fits the unit sphere, or input, the "
        "coordinates of the shape's file (default: model)",
        choices=("model", "input"),
    )
    shade: str | None = option(
        None,
        f"shading that the text opens in ({_OPENING}; default: {OPENING_SHADES[0]}, but phong in short texts of "
        "shadertoy)",
        choices=OPENING_SHADES,
        old=OLD_SHADES,
    )
    with_march: bool = option(False, f"also write NAME_trace, which intersects a ray with the surface ({_MARCH})")
    studio: bool = option(False, f"let the page also train dropped meshes ({_STUDIO})")


@dataclass(frozen=True)
class InfoOptions(Options):
    """Options of `info`, for the command line and for Python."""

    sizes: bool = option(False, "also bake every target to count its bytes, which takes some seconds", study=True)


@dataclass(frozen=True)
class PackOptions(Options):
    """Options of `pack`, for the command line and for Python (docs/format.md)."""

    bits: str | float = option(
        AUTOMATIC,
        "bits for each weight, on average, such as 6.5; auto: the fewest that add about 8 % to the distance and 4 % to "
        "the angle that the training measured",
        metavar="N|auto",
    )
