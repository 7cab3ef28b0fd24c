"""A scene: a tree of placed and combined shapes, and its JSON in the file of a model (docs/scenes.md).

Its numbers are expressions in the time t (model/expression.py). A node maps a point x from its local space to its
parent's space: rotate(scale * x) + translate, where the axis of rotation passes through the origin.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from .checks import check_finite
from .errors import UserError
from .expression import ONE, TIME, ZERO, Expression, number, product
from .expression_reader import read

UNION, SMOOTH_UNION, INTERSECTION, DIFFERENCE = OPERATIONS = ("union", "smooth union", "intersection", "difference")
"""Operations of a group; a difference is the first part minus all others."""
MOST_SHAPES = 64
"""Largest number of shapes of a scene."""
MOST_DEPTH = 16
"""Largest depth of nested groups in the file of a scene."""
MOST_NESTED = MOST_DEPTH + 2
"""The same in the file of a model, where groups place the scene in the unit sphere and join it with the ground."""
SMALLEST_SCALE = 1e-7
"""Smallest scale of a node, and of a shape in the whole scene; float32 counts the largest as seven digits of it."""
MOST_FORMULAS = 10_000
"""Most characters of all formulas of a scene: to bound their values takes up to a quarter of a millisecond each."""
PLACEMENT_KEYS = ("translate", "axis", "angle", "scale")
"""Keys of a placement, in the file of a scene and in the file of a model."""


@dataclass(frozen=True)
class Placement:
    """The map from a node's local space to its parent's space."""

    translate: tuple[Expression, Expression, Expression] = (ZERO, ZERO, ZERO)
    """Translation, applied last."""
    axis: tuple[float, float, float] = (0.0, 1.0, 0.0)
    """Axis of rotation, of length 1."""
    angle: Expression = ZERO
    """Angle of rotation, in degrees, counterclockwise as seen from the end of the axis."""
    scale: Expression = ONE
    """Scale, above 0, applied first."""

    @property
    def moves(self) -> bool:
        """Whether any number depends on the time."""
        return any(value.moves for value in (*self.translate, self.angle, self.scale))


@dataclass(frozen=True)
class Shape:
    """A model in the scene."""

    model: int
    """Index into `Model.shapes`."""
    time: Expression = TIME
    """Time of a moving model: its fourth input."""
    placement: Placement = Placement()
    """Placement of model space."""


@dataclass(frozen=True)
class Disc:
    """A ground: a round plate around the y axis with its upper side at y = 0, inside the unit sphere."""

    thickness: float
    """From 0.001 to 0.9."""
    color: tuple[float, float, float]
    """sRGB in [0, 1]."""
    placement: Placement = Placement()
    """Placement of the unit sphere."""

    @property
    def radius(self) -> float:
        """Radius of the plate: its lower rim lies on the unit sphere."""
        return math.sqrt(1 - self.thickness**2)


@dataclass(frozen=True)
class Group:
    """Nodes combined by an operation."""

    operation: str
    """One of `OPERATIONS`."""
    parts: "tuple[Node, ...]"
    """At least one."""
    radius: Expression = ZERO
    """Blend radius of a smooth union, above 0, in local units: parts blend where their distances differ by less."""
    placement: Placement = Placement()
    """Placement of the whole group."""


Node = Shape | Disc | Group


def shapes_of(node: Node) -> Iterator[Shape | Disc]:
    """Yield the leaves of a tree in order."""
    if isinstance(node, Group):
        for part in node.parts:
            yield from shapes_of(part)
    else:
        yield node


def moves(node: Node, moving: Sequence[bool]) -> bool:
    """Whether a tree depends on the time. moving: for each model, whether it does."""
    own = node.placement.moves
    match node:
        case Group(parts=parts, radius=radius):
            return own or radius.moves or any(moves(part, moving) for part in parts)
        case Shape(model=model, time=time):
            return own or (moving[model] and time.moves)
        case _:
            return own


def renumbered(node: Node, change: Callable[[int], int]) -> Node:
    """Return a tree with changed indices of models."""
    match node:
        case Group(parts=parts):
            return replace(node, parts=tuple(renumbered(part, change) for part in parts))
        case Shape(model=model):
            return replace(node, model=change(model))
        case _:
            return node


def to_json(node: Node) -> dict[str, Any]:
    """Return the JSON object of a tree; `from_json` reads it."""
    place = node.placement
    placed = {
        "translate": [value.written() for value in place.translate],
        "axis": list(place.axis),
        "angle": place.angle.written(),
        "scale": place.scale.written(),
    }
    match node:
        case Shape(model=model, time=time):
            return {"model": model, "time": time.written()} | placed
        case Disc(thickness=thickness, color=color):
            return {"thickness": thickness, "color": list(color)} | placed
        case Group(operation=operation, parts=parts, radius=radius):
            return {"operation": operation, "radius": radius.written(), "parts": list(map(to_json, parts))} | placed


def from_json(value: Any, models: int) -> Node:
    """Read and check the tree in the file of a model. models: number of models. Raises UserError."""
    leaves, formulas = extent(value)
    if leaves > MOST_SHAPES:
        raise UserError(f"scene: more than {MOST_SHAPES} shapes")
    check_formulas(formulas, "scene")
    return _node(value, models, "scene", 0)


def extent(value: Any, depth: int = 0) -> tuple[int, int]:
    """Count the leaves of a tree that is not checked, and the characters of its formulas."""
    if not isinstance(value, dict) or depth > MOST_NESTED:
        return 1, 0
    texts = [value.get(key) for key in ("time", "radius", "angle", "scale")]
    moved, parts = value.get("translate"), value.get("parts")
    texts += moved[:3] if isinstance(moved, list) else []
    inner = [extent(part, depth + 1) for part in parts] if isinstance(parts, list) else []
    leaves = sum(count for count, _ in inner) if inner else 1
    return leaves, sum(len(text) for text in texts if isinstance(text, str)) + sum(size for _, size in inner)


def check_formulas(size: int, where: str) -> None:
    """Raise UserError for more characters than `MOST_FORMULAS`."""
    if size > MOST_FORMULAS:
        raise UserError(f"{where}: more than {MOST_FORMULAS:,} characters of formulas")


def check_tree(root: Node, models: int) -> None:
    """Check that targets can say the numbers of a tree, and that `from_json` reads what `to_json` writes.

    models: number of models. Raises UserError.
    """
    from_json(to_json(root), models)
    _check_sizes(root, (), "scene")


def _check_sizes(node: Node, scales: tuple[Expression, ...], where: str) -> None:
    """Check the sizes of shapes and radii in the whole scene. scales: of the enclosing groups."""
    scales = (*scales, node.placement.scale)
    try:
        scale = product(*scales)
        if scale.range()[0] < SMALLEST_SCALE:
            raise UserError(f"less than {SMALLEST_SCALE:g} of the scene's radius at some t of [0, 1]")
        if isinstance(node, Group):
            product(node.radius, scale).range()
    except UserError as error:
        raise UserError(f"{where}.scale: in the whole scene, {error}") from None
    for i, part in enumerate(node.parts if isinstance(node, Group) else (), start=1):
        _check_sizes(part, scales, f"{where}.parts[{i}]")


def _node(value: Any, models: int, where: str, depth: int) -> Node:
    if not isinstance(value, dict):
        raise UserError(f"{where}: is not an object of keys and values")
    placement = placed(value, where)
    if "parts" in value:
        parts = value["parts"]
        if not isinstance(parts, list) or not parts or depth == MOST_NESTED:
            raise UserError(f"{where}.parts: is not a list of nodes, or nested too deeply")
        nodes = tuple(_node(part, models, f"{where}.parts[{i}]", depth + 1) for i, part in enumerate(parts, start=1))
        return group(value, nodes, placement, where)
    if "thickness" in value:
        check_finite(f"{where}.thickness", value["thickness"])
        if not 0.001 <= value["thickness"] <= 0.9:
            raise UserError(f"{where}.thickness: must be from 0.001 to 0.9")
        return Disc(float(value["thickness"]), color(value.get("color"), where), placement)
    model = value.get("model")
    if type(model) is not int or not 0 <= model < models:
        raise UserError(f"{where}.model: is not the number of a model from 0 to {models - 1}")
    return Shape(model, expression(value, "time", Expression("t"), where), placement)


def group(value: Mapping[str, Any], parts: tuple[Node, ...], placement: Placement, where: str) -> Group:
    """Read a group's operation and radius. Raises UserError that begins with `where` and the key."""
    operation = value.get("operation", UNION)
    if operation not in OPERATIONS:
        raise UserError(f"{where}.operation: choose one of {', '.join(OPERATIONS)}")
    radius = expression(value, "radius", number(0), where)
    if operation == SMOOTH_UNION and radius.range()[0] <= 0:
        raise UserError(f"{where}.radius: must be positive at all t of [0, 1]")
    return Group(operation, parts, radius, placement)


def placed(value: Mapping[str, Any], where: str) -> Placement:
    """Read the placement of a node. Raises UserError that begins with `where` and the key."""
    translate = value.get("translate", [0, 0, 0])
    if not isinstance(translate, list) or len(translate) != 3:
        raise UserError(f"{where}.translate: three numbers are needed")
    axis = value.get("axis", [0, 1, 0])
    if not isinstance(axis, list) or len(axis) != 3:
        raise UserError(f"{where}.axis: three numbers are needed")
    for number_ in axis:
        check_finite(f"{where}.axis", number_)
    length = math.hypot(*axis)
    if not 1e-6 < length < 1e6:
        raise UserError(f"{where}.axis: its length must be positive")
    length = 1.0 if abs(length - 1) < 1e-12 else length  # as `to_json` wrote it
    x, y, z = (_expression(part, f"{where}.translate") for part in translate)
    scale = expression(value, "scale", number(1), where)
    if scale.range()[0] < SMALLEST_SCALE:
        raise UserError(f"{where}.scale: must be positive at all t of [0, 1], {SMALLEST_SCALE:g} or more")
    turned = (axis[0] / length, axis[1] / length, axis[2] / length)
    return Placement((x, y, z), turned, expression(value, "angle", number(0), where), scale)


def expression(value: Mapping[str, Any], key: str, default: Expression, where: str) -> Expression:
    """Read the expression under a key. Raises UserError that begins with `where` and the key."""
    return _expression(value[key], f"{where}.{key}") if key in value else default


def color(value: Any, where: str) -> tuple[float, float, float]:
    """Read three numbers from 0 to 1, sRGB. Raises UserError that begins with `where`."""
    if not isinstance(value, list) or len(value) != 3:
        raise UserError(f"{where}.color: three numbers from 0 to 1 are needed")
    red, green, blue = (_share(channel, f"{where}.color") for channel in value)
    return red, green, blue


def _expression(value: Any, key: str) -> Expression:
    try:
        return read(value)
    except UserError as error:
        raise UserError(f"{key}: {error}") from None


def _share(value: Any, key: str) -> float:
    check_finite(key, value)
    if not 0 <= value <= 1:
        raise UserError(f"{key}: must be from 0 to 1")
    return float(value)
