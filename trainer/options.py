"""The options of `train`, `morph` and `import`, for the command line and for Python. Nothing here needs torch."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..model.bits import read_bits
from ..model.errors import UserError
from ..model.options import Options, option
from ..model.orientation import UPRIGHT
from ..model.references import follow_option
from ..readers.column_names import parse_columns
from . import settings as parse
from .config import LossWeights
from .settings import DEFAULT_PRESET, PRESETS, Settings

MOST_SECONDS = 1e7
"""Longest training, some 116 days."""
CREASE = 30.0
"""Default of --crease, degrees."""
FRONT_HELP = "first view of the model: degrees around, 0 from +z and 90 from +x, and degrees above"
CREDIT_HELP = "author and license of the shape: 'Keenan Crane, CC0'"
_PRESETS = "; ".join(f"{name} = {preset.levels}{' --packed' * preset.packed}" for name, preset in PRESETS.items())

Numbers = str | Sequence[float] | float
"""Numbers, or their text with commas between."""


class _ShapeOptions:
    """What the options of `train`, `morph` and `check` say of the reading of a shape."""

    texture: str
    crease: float
    flat: bool

    @property
    def crease_angle(self) -> float | None:
        """Angle in degrees above which an edge of a mesh may be a crease; None: faces are flat."""
        return None if self.flat else self.crease

    @property
    def image(self) -> Path | None:
        """Image of the texture, where the user names one."""
        return None if self.texture in ("auto", "none") else Path(self.texture)


@dataclass(frozen=True)
class TrainingOptions(_ShapeOptions, Options):
    """Options of `train` and `morph` (docs/training.md)."""

    levels: str | Sequence[str] | None = option(
        None,
        "width and hidden layers of each level, coarse to fine: 64x1,64x2,128x2",
        metavar="NxD,..",
        group="network",
    )
    preset: str = option(DEFAULT_PRESET, f"levels by name: {_PRESETS}", choices=tuple(PRESETS), group="network")
    packed: bool = option(
        False, "quantize the weights to a few bits, for short shader texts (bake --target shadertoy)", group="network"
    )
    omega: Numbers | None = option(
        None,
        "omega_0 of each level (default: 40,80,120; less below 64 wide and for smooth shapes), then of the texture "
        "(default: 50)",
        metavar="W,..",
        study=True,
        group="network",
    )
    seconds: float | None = option(
        None,
        "seconds of wall time for the whole training",
        metavar="S",
        least=1,
        most=MOST_SECONDS,
        excludes="steps",
        group="training",
    )
    steps: Numbers | None = option(
        None,
        "optimizer steps of each level, then of the texture (the same seed and steps give the same weights)",
        metavar="N,..",
        group="training",
    )
    texture: str = option(
        "auto",
        "auto: learn colors where the shape has them, of a material's image, of vertices or points; none: geometry "
        "only; FILE: an image, by texture coordinates",
        metavar="auto|none|FILE",
        group="shape",
    )
    texture_network: str | None = option(
        None,
        "width and hidden layers of the texture (default: those of the last level, 64x2 at most)",
        metavar="NxD",
        study=True,
        group="network",
    )
    crease: float = option(
        CREASE,
        "a mesh stands for a curved surface; its edges are sharp where they bend by more than this angle and their "
        "neighbors do not; normals in the file take precedence",
        metavar="DEG",
        least=0,
        most=180,
        group="shape",
    )
    flat: bool = option(False, "keep a mesh's faces flat, and every edge sharp", excludes="crease", group="shape")
    up: str | None = option(
        None,
        "axis of the shape's file that points up (default: y, or that of the file's format)",
        choices=UPRIGHT,
        group="shape",
    )
    front: Numbers | None = option(None, FRONT_HELP, metavar="AZ,EL", group="shape")
    credit: str | None = option(None, CREDIT_HELP, metavar="TEXT", group="shape")
    seed: int = option(0, "seed of all random numbers", metavar="K", least=0, most=2**40 - 1, group="training")
    device: str = option(
        "auto",
        "where to train; auto: on a CUDA device if there is one",
        choices=("auto", "cpu", "cuda"),
        group="training",
    )
    weights: str | Mapping[str, float] | None = option(
        None,
        f"weights of the loss: {', '.join(LossWeights.__dataclass_fields__)} (trainer/config.py)",
        metavar="NAME=X,..",
        study=True,
        group="training",
    )
    log: str | Path | None = option(
        None,
        "write a line of JSON for every report: the loss, its terms, and mean |f| at held-out points",
        metavar="FILE.jsonl",
        group="training",
    )
    quiet: bool = option(False, "show no progress bar, and not what was read of the shape", group="training")
    follow: bool = follow_option()

    def __post_init__(self) -> None:
        super().__post_init__()
        self.settings()  # raises UserError for texts that it cannot read

    def settings(self) -> Settings:
        """Return the settings of the training. Raises UserError."""
        preset = PRESETS[self.preset]
        named = self.levels if isinstance(self.levels, str) else ",".join(self.levels or ())
        sizes = parse.networks(named or preset.levels)
        weights = self.weights
        if isinstance(weights, Mapping):
            weights = ",".join(f"{name}={number}" for name, number in weights.items())
        texture = self.texture_network
        return Settings(
            networks=sizes,
            omegas=parse.omegas(text_of(self.omega), sizes),
            steps=parse.steps(text_of(self.steps), len(sizes)),
            seconds=self.seconds,
            texture=self.texture != "none",
            seed=self.seed,
            device=self.device,
            weights=parse.loss_weights(weights),
            packed=self.packed or (preset.packed and not named),
            noise=getattr(self, "noise", None),  # `morph` has none
            texture_network=parse.networks(texture, "--texture-network")[0] if texture else None,
            up=self.up,
            front=parse.front(text_of(self.front)),
            credit=self.credit or "",
        )


@dataclass(frozen=True)
class TrainOptions(TrainingOptions):
    """Options of `train` (docs/training.md)."""

    time: bool = option(
        False,
        "SHAPE is a folder of meshes, the moments of a motion: sorted by name, evenly spaced from t = 0 to t = 1",
        group="shape",
    )
    noise: float | None = option(
        None,
        "standard deviation of a cloud's points, as a share of the shape's radius, such as 0.01; 0: the points are "
        "exact, and none is an outlier (default: measured)",
        metavar="S",
        least=0,
        most=0.1,
        group="shape",
    )
    columns: str | Sequence[str] | None = option(
        None,
        "what the columns of a cloud are: x,y,z,nx,ny,nz,r,g,b in the file's order, - for one that is not used "
        "(default: by their names, or by their lengths and ranges)",
        metavar="NAME,..",
        group="shape",
    )
    bits: str | float | None = option(
        None,
        "round the weights of the finished model to few bits, as `pack` does: for each weight, or auto",
        metavar="N|auto",
        excludes="time",
        group="network",
    )
    thicken: float | None = option(
        None,
        "treat an open mesh as a sheet with this distance to either side, as a share of its radius, such as 0.02",
        metavar="T",
        least=0.001,  # Networks do not resolve thinner sheets.
        most=1,
        group="shape",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        parse_columns(self.columns)
        if self.bits is not None:
            read_bits(self.bits)


def _as_in_train(name: str) -> Any:
    """Declare an option of `train` again."""
    declared = TrainOptions.__dataclass_fields__[name]
    return field(default=declared.default, metadata=declared.metadata)


@dataclass(frozen=True)
class CheckOptions(_ShapeOptions, Options):
    """Options of `check`: those of `train` that say how a shape is read."""

    texture: str = _as_in_train("texture")
    crease: float = _as_in_train("crease")
    flat: bool = _as_in_train("flat")
    up: str | None = _as_in_train("up")
    noise: float | None = _as_in_train("noise")
    columns: str | Sequence[str] | None = _as_in_train("columns")
    thicken: float | None = _as_in_train("thicken")
    follow: bool = _as_in_train("follow")


@dataclass(frozen=True)
class MorphOptions(TrainingOptions):
    """Options of `morph` (docs/training.md)."""

    texture: str = option(
        "auto",
        "auto: learn colors where the shapes have them; none: geometry only",
        choices=("auto", "none"),
        group="shape",
    )
    in_place: bool = option(
        False, "keep both shapes at their places in their common space (default: each fits the unit sphere)"
    )


@dataclass(frozen=True)
class ImportOptions(Options):
    """Options of `import` (docs/training.md)."""

    omega: Numbers | None = option(
        None, "omega_0 of each file, for files without it (*_with_w0.pth)", metavar="W,..", study=True, group="network"
    )
    shape: str | Path | None = option(
        None,
        "shape of the training: its points give the bands, its coordinates the model's (default: the last level's "
        "surface gives the bands)",
        metavar="SHAPE",
    )
    front: Numbers | None = option(None, FRONT_HELP, metavar="AZ,EL", group="shape")
    credit: str | None = option(None, CREDIT_HELP, metavar="TEXT", group="shape")
    follow: bool = follow_option()

    def omegas(self, count: int) -> list[float | None]:
        """Return omega_0 of each of `count` checkpoints; None stands for that of the file. Raises UserError."""
        text = text_of(self.omega)
        if text is None:
            return [None] * count
        try:
            values: list[float | None] = [float(part) for part in text.split(",")]
        except ValueError:
            raise UserError(f"--omega {text}: numbers joined by commas are needed") from None
        if len(values) != count:
            raise UserError(f"--omega: {len(values)} of {count} numbers; name one for each file")
        return values

    def view(self) -> tuple[float, float] | None:
        """Return `Model.front`. Raises UserError."""
        return parse.front(text_of(self.front))


def text_of(numbers: Numbers | None) -> str | None:
    """Return numbers as text with commas between, for the parsers of settings.py."""
    if numbers is None or isinstance(numbers, str):
        return numbers
    return ",".join(map(repr, [numbers] if isinstance(numbers, (int, float)) else map(float, numbers)))
