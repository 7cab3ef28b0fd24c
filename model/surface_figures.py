"""How far a model's surface is from a shape's, in both directions: for `train`, `info` and `eval`."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

FAR = 0.02
"""A point of a model's surface is invented where the shape is farther away, model units."""
MUCH_INVENTED = 0.03
"""Largest share of invented surface that needs no warning."""
MOST = 180.0
"""Largest figure: an angle in degrees."""
DIFFERENT = 1.5
"""Least ratio of the figures against a mesh's flat faces to those against its curved surface that is told."""


@dataclass(frozen=True)
class SurfaceFigures:
    """Distances between the surfaces of a model and of a shape, and the angle between their normals."""

    distance_mean: float | None
    """Mean distance of the model's surface to the shape, model units; None where that is not known."""
    missing_mean: float
    """Mean distance of the shape's surface to the model's, model units."""
    normal_angle: float
    """Mean angle between the field's gradient and the shape's normals, on the shape, degrees."""
    invented: float | None
    """Share of the model's surface that is invented; see `FAR`. None where that is not known."""

    @property
    def distance(self) -> float:
        """Mean distance of both directions, model units."""
        return self.missing_mean if self.distance_mean is None else (self.distance_mean + self.missing_mean) / 2

    def differs(self, other: "SurfaceFigures") -> bool:
        """Whether a figure is so much smaller or larger than the other's that both need to be told."""
        pairs = (self.distance, other.distance), (self.normal_angle, other.normal_angle)
        return any(max(pair) > DIFFERENT * min(pair) for pair in pairs)

    def told(self) -> str:
        """Describe the distance and the angle."""
        which = "one direction" if self.distance_mean is None else "both directions"
        return f"{self.distance:.2e} (mean of {which}), normals by {self.normal_angle:.2f} degrees"

    def warning(self, *, open_mesh: bool) -> str:
        """Return a line about invented surface; "" where there is little."""
        covered = self.missing_mean < FAR  # else it is far from the mesh, not across openings
        return invented_line(self.invented, open_mesh=open_mesh and covered)


@dataclass(frozen=True)
class SurfaceRecord:
    """The figures that a training measured, as the model's provenance holds them."""

    shape: SurfaceFigures
    """Against the shape that was trained: of a mesh, by default, its curved surface."""
    flat: SurfaceFigures | None
    """Against the flat faces of the shape's file; None where the training did not curve them."""
    open: bool
    """Whether the shape is a mesh with a boundary."""

    def told(self) -> list[tuple[str, str]]:
        """Describe the figures: (label, text), a second one where flat faces give other figures."""
        rows = [("surface", f"off by {self.shape.told()}")]
        if self.flat is not None and self.flat.differs(self.shape):
            rows.append(("flat faces", f"off by {self.flat.told()}; the training curved them (--flat does not)"))
        return rows

    def warning(self) -> str:
        """Return a line about invented surface; "" where there is little."""
        return self.shape.warning(open_mesh=self.open)

    def to_json(self) -> dict[str, Any]:
        """Return the figures for the provenance."""
        return asdict(self)


def invented_line(share: float | None, *, open_mesh: bool) -> str:
    """Return a line about the share of invented surface, with its remedy; "" where it is small or unknown."""
    if share is None or share <= MUCH_INVENTED:
        return ""
    remedy = (
        f"it closes the mesh's openings; --thicken {FAR:g} trains the sheets as they are"
        if open_mesh
        else "more steps, or larger --levels, keep it nearer"
    )
    return f"{share:.0%} of the model's surface is more than {FAR:g} radii from the shape: {remedy}"


def surface_record(provenance: Mapping[str, Any]) -> SurfaceRecord | None:
    """Read the figures of a provenance, which may have any content; None where it has none."""
    record = provenance.get("surface")
    if not isinstance(record, dict) or (shape := _figures(record.get("shape"))) is None:
        return None
    return SurfaceRecord(shape, _figures(record.get("flat")), record.get("open") is True)


def _figures(record: object) -> SurfaceFigures | None:
    if not isinstance(record, dict):
        return None
    distance, missing, angle, invented = (_number(record.get(name)) for name in SurfaceFigures.__dataclass_fields__)
    return None if missing is None or angle is None else SurfaceFigures(distance, missing, angle, invented)


def _number(value: object) -> float | None:
    """Return a figure; None where a file has something that is none."""
    return float(value) if isinstance(value, (int, float)) and 0 <= value <= MOST else None
