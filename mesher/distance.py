"""The error of a model's field as a signed distance."""

import igl
import numpy as np

from ..field.interpret import field_gradient, nested_field
from ..ir.lower import lower
from ..model.field_figures import FieldFigures, field_figures
from ..model.model import Model
from .metrics import Doubles, SampledSurface
from .surface import Mesh


def compare_field(model: Model, truth: Mesh, samples: int, seed: int = 0, time: float = 0.0) -> FieldFigures:
    """Compare a model's field with the signed distance to its ground truth, a mesh in model space.

    samples: number of points in the unit ball, on the surface, and around the surface, each. seed: seed of the points.
    time: time of a moving model.
    """
    rng = np.random.default_rng(seed)
    program, count = lower(model), len(model.levels)
    surface = SampledSurface(truth)
    winding = igl.FastWindingNumberBVH()
    winding.init(truth.vertices.astype(np.float64), truth.faces)

    def known(points: Doubles) -> tuple[Doubles, Doubles]:
        """Return f and the signed distance at points (N, 3): (N,) each."""
        distance = surface.distance(points)[0]
        inside = winding.winding_number(points) > 0.5
        f = nested_field(program, points.astype(np.float32), count, time)[0]
        return f.astype(np.float64), np.where(inside, -distance, distance)

    directions = rng.normal(size=(samples, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    on_surface, _ = surface.sample(samples, rng)
    before = max(1, count - 1)
    delta = model.levels[before - 1].delta
    around = on_surface + rng.uniform(-delta, delta, on_surface.shape)
    f, reached = nested_field(program, around.astype(np.float32), before, time)
    return field_figures(
        domain=known(directions * np.cbrt(rng.random(samples))[:, None]),
        band=known(around[(reached == before) & (np.abs(f) < delta)]),
        gradients=field_gradient(program, on_surface.astype(np.float32), count, time)[0],
    )
