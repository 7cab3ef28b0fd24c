"""The time at which a moving model is evaluated, and the placement of its shape in input space then."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..model.model import Model

    Place = tuple[tuple[float, float, float], float, str]


def chosen_time(time: float | None, model: "Model") -> float:
    """Return the time of --time, 0 by default. Raises UserError for a model that does not move."""
    from ..model.errors import UserError

    if time is not None and model.inputs != "xyzt":
        raise UserError(f"--time {time:g}: this model does not move; leave the option out")
    return time or 0.0


def place_at(model: "Model", time: float) -> "Place":
    """Return the place of model space in input space (`Model.place`) at a time.

    Training may move and scale each shape of a motion to fit the unit sphere (trainer/motion.py); the provenance
    records it. Between the shapes, center and scale are interpolated linearly.
    """
    import numpy as np

    source = model.provenance.get("source")
    moments = source.get("moments") if isinstance(source, dict) else None
    if not isinstance(moments, list) or len(moments) < 2:
        return model.place
    try:
        scales = np.array([moment["scale"] / moment["factor"] for moment in moments], np.float64)
        centers = np.array([moment["centre"] for moment in moments], np.float64)
        centers -= scales[:, None] * np.array([moment["offset"] for moment in moments], np.float64)
    except (KeyError, TypeError, ValueError, ZeroDivisionError):  # not written by this program's training
        return model.place
    if centers.shape != (len(moments), 3) or not np.isfinite(centers).all() or not (scales > 0).all():
        return model.place
    at = np.linspace(0, 1, len(moments))
    x, y, z = (float(np.interp(time, at, column)) for column in centers.T)
    return (x, y, z), float(np.interp(time, at, scales)), model.up
