"""The model of a scene: its space is scaled into the unit sphere, and its levels combine the levels of its shapes."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..field.lowest import lowest_point
from ..ir.lower import lower
from ..model.errors import UserError
from ..model.expression import LARGEST, number
from ..model.model import Level, Model
from ..model.scene import (
    DIFFERENCE,
    INTERSECTION,
    SMOOTH_UNION,
    UNION,
    Disc,
    Group,
    Node,
    Placement,
    Shape,
    moves,
)
from .scene_file import Ground, SceneFile, read_scene

TIMES = np.linspace(0, 1, 129)
"""Times at which the bounding ball of a scene is computed."""
SLACK = 1.005
"""Factor on the radius of a moving scene: between two times, parts may be farther out."""
GROUND_RADIUS, GROUND_THICKNESS = 1.0, 0.05
"""Default radius of the ground per radius of the scene, and default thickness per radius of the ground."""
CLOSER = 200
"""Iterations towards the center of the smallest ball."""

Values = NDArray[np.float64]
Balls = list[tuple[Values, Values]]
"""Centers (T, 3) and radii (T,) of balls at TIMES."""


def compose(scene: Path | str, follow: bool = False) -> Model:
    """Read the file of a scene and return its model. follow: of `Folder`. Raises UserError."""
    return composed(read_scene(Path(scene), follow))


def composed(read: SceneFile) -> Model:
    """Return the model of a scene that was read. Raises UserError."""
    root = read.root
    if read.ground is not None:
        root = Group(UNION, (root, _plate(read, read.ground)))
    return _model(read, root)


def _model(read: SceneFile, root: Group) -> Model:
    """Return the model of a scene's tree."""
    moving = moves(root, [shape.inputs == "xyzt" for shape in read.models])
    center, radius = _ball(_balls(root), SLACK if moving else 1.0)
    if not 1 / LARGEST <= radius <= LARGEST or np.abs(center).max() > LARGEST * radius:
        raise UserError(
            f"the scene's radius is {radius:.3g}: from a millionth, also of its distance from 0, to a million is needed"
        )
    x, y, z = (float(-coordinate / radius) for coordinate in center)
    place = Placement((number(x), number(y), number(z)), scale=number(1 / radius))
    placed = Group(UNION, (root,), placement=place)
    credits = dict.fromkeys(shape.credit for shape in read.models if shape.credit)
    return Model(
        name=read.name,
        levels=_levels(placed, read.models),
        center=(float(center[0]), float(center[1]), float(center[2])),
        scale=radius,
        front=read.front,
        credit="; ".join(credits) if read.credit is None else read.credit,
        inputs="xyzt" if moving else "xyz",
        provenance={"scene": {"sha256": read.sha256, "shapes": [shape.name for shape in read.models]}},
        shapes=tuple(read.models),
        scene=placed,
    )


def _levels(root: Node, models: list[Model]) -> tuple[Level, ...]:
    """Return the levels of a scene, model space.

    An operation changes no more than its operands change. So the band of a level is the widest band among the shapes
    with a finer level (Eq. 5), and a step is at most the smallest step among the shapes.
    """
    scaled = [(models[node.model], scale) for node, scale in _scales(root, 1.0)]
    count = max(len(model.levels) for model, _ in scaled)
    levels = []
    for i in range(count):
        refined = [(model, scale) for model, scale in scaled if len(model.levels) > min(i + 1, count - 1)]
        own = [(model.levels[min(i, len(model.levels) - 1)], i + 1 < len(model.levels)) for model, _ in scaled]
        levels.append(
            Level(
                network=(),
                delta=max(scale * model.levels[i].delta for model, scale in refined),
                iterations=max(level.iterations for level, _ in own),
                lipschitz=max(level.lipschitz for level, _ in own),
                step_bound=min(level.step_bound for level, _ in own),
                band_step_bound=min(level.band_step_bound if finer else level.step_bound for level, finer in own),
            )
        )
    return tuple(levels)


def _scales(node: Node, scale: float) -> list[tuple[Shape, float]]:
    """Return the shapes that are models, each with its largest scale over time."""
    scale *= node.placement.scale.range()[1]
    match node:
        case Group(parts=parts):
            return [entry for part in parts for entry in _scales(part, scale)]
        case Shape():
            return [(node, scale)]
        case _:
            return []


def _balls(node: Node) -> Balls:
    """Return bounding balls of a node, in its parent's space."""
    if not isinstance(node, Group):
        balls = [(np.zeros((len(TIMES), 3)), np.ones(len(TIMES)))]
    else:
        parts = [_balls(part) for part in node.parts]
        if node.operation == DIFFERENCE:
            parts = parts[:1]
        if node.operation == INTERSECTION:
            parts = [min(parts, key=lambda balls: _ball(balls, 1.0)[1])]
        swollen = _at(node, "radius") / 4 * (len(node.parts) - 1) if node.operation == SMOOTH_UNION else 0.0
        balls = [(centers, radii + swollen) for part in parts for centers, radii in part]
    scale = _at(node, "scale")
    translate = np.array([[value.at(time) for value in node.placement.translate] for time in TIMES])
    angle = np.radians([node.placement.angle.at(time) for time in TIMES])[:, None]
    axis = np.array(node.placement.axis)

    def turned(points: Values) -> Values:
        along = (points @ axis)[:, None] * axis
        return np.asarray(along + np.cos(angle) * (points - along) + np.sin(angle) * np.cross(axis, points))

    return [(turned(scale[:, None] * centers) + translate, scale * radii) for centers, radii in balls]


def _at(node: Node, name: str) -> Values:
    """Return a number of a node or of its placement at TIMES."""
    value = node.radius if name == "radius" and isinstance(node, Group) else getattr(node.placement, name)
    return np.array([value.at(time) for time in TIMES])


def _ball(balls: Balls, slack: float) -> tuple[Values, float]:
    """Return the center (3,) and the radius of a small ball around others (Badoiu and Clarkson 2003)."""
    centers, radii = np.concatenate([ball[0] for ball in balls]), np.concatenate([ball[1] for ball in balls])
    middle = (centers - radii[:, None]).min(axis=0) / 2 + (centers + radii[:, None]).max(axis=0) / 2
    best, least = middle, np.inf
    for i in range(CLOSER):
        away = np.linalg.norm(centers - middle, axis=1) + radii
        if away.max() < least:
            best, least = middle, float(away.max())
        farthest = int(away.argmax())
        middle = middle + (centers[farthest] - middle) * (1 - radii[farthest] / away.max()) / (i + 2)
    return best, least * slack


def _plate(read: SceneFile, ground: Ground) -> Disc:
    """Return the ground of a scene, in the file's unit; by default under the lowest point of all times."""
    standing = _model(read, read.root)
    height = ground.height
    if height is None:
        height = standing.center[1] + standing.scale * lowest_point(lower(standing))
    beside = float(np.hypot(standing.center[0], standing.center[2]))
    radius = ground.radius or GROUND_RADIUS * standing.scale + beside
    thickness = ground.thickness or GROUND_THICKNESS * radius
    scale = float(np.hypot(radius, thickness))
    if not 0.001 <= thickness / scale <= 0.9:
        raise UserError("ground.thickness: from a thousandth of the radius to twice as much")
    place = Placement((number(0), number(height), number(0)), scale=number(scale))
    return Disc(thickness / scale, ground.color, place)
