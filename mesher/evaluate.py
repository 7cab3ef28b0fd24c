"""The evaluation protocol of the paper's Section 4, and figures beside it that say what a Chamfer distance does not."""

from dataclasses import dataclass

import numpy as np

from .metrics import SampledSurface, angles, chamfer, shell_iou
from .parallel import Progress, Silent
from .surface import Mesh, Whole


@dataclass(frozen=True)
class Figures:
    """Lengths are in model units, angles in degrees.

    chamfer: squared-L2, both directions summed, `samples` points on each side. floor: the same of two samplings of the
    ground truth: a perfect reconstruction's. hausdorff: largest distance of a sample to the other surface.
    distance_mean, distance_99: from the reconstruction's samples to the true surface, mean and 99th percentile.
    missing_mean, missing_99: from the truth's samples to the reconstruction. normal_angle: mean, between the normals of
    a sample's face and of the closest true face. iou: see `metrics.shell_iou`.
    """

    samples: int
    seed: int
    chamfer: float
    floor: float
    hausdorff: float
    distance_mean: float
    distance_99: float
    missing_mean: float
    missing_99: float
    normal_angle: float
    iou: float
    components: int
    truth_components: int
    watertight: bool
    vertices: int
    faces: int


def compare(
    reconstruction: Mesh, truth: Mesh, samples: int = 500_000, seed: int = 0, progress: Progress | None = None
) -> Figures:
    """A mesh against its ground truth, both in model space. The seed decides all samples."""
    progress = progress or Silent()
    progress.begin("comparing", 6)
    rng = np.random.default_rng(seed)
    ours, true = SampledSurface(reconstruction), SampledSurface(truth)
    (on_true, _), (again, _) = true.sample(samples, rng), true.sample(samples, rng)
    on_ours, faces = ours.sample(samples, rng)
    progress.advance(1)
    summed = chamfer(on_ours, on_true)
    progress.advance(1)
    floor = chamfer(again, on_true)
    progress.advance(1)
    distance, closest = true.distance(on_ours)
    progress.advance(1)
    missing, _ = ours.distance(on_true)
    progress.advance(1)
    iou = shell_iou(ours, true, np.concatenate((on_ours, on_true)))
    progress.advance(1)
    return Figures(
        samples=samples,
        seed=seed,
        chamfer=summed,
        floor=floor,
        hausdorff=float(max(distance.max(), missing.max())),
        distance_mean=float(distance.mean()),
        distance_99=float(np.quantile(distance, 0.99)),
        missing_mean=float(missing.mean()),
        missing_99=float(np.quantile(missing, 0.99)),
        normal_angle=float(angles(ours.normals[faces], true.normals[closest]).mean()),
        iou=iou,
        components=reconstruction.components()[0],
        truth_components=truth.components()[0],
        watertight=is_watertight(reconstruction.faces),
        vertices=len(reconstruction.vertices),
        faces=len(reconstruction.faces),
    )


def is_watertight(faces: Whole) -> bool:
    """Whether every edge of the faces (F, 3) is passed once each way."""
    one, other = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    size = int(faces.max()) + 1
    forth, back = np.sort(one * size + other), np.sort(other * size + one)
    return bool((forth == back).all() and (forth[1:] != forth[:-1]).all())
