"""The evaluation protocol of the paper (Section 4), with further metrics that a Chamfer distance hides."""

from dataclasses import dataclass

import numpy as np

from ..model.surface_figures import FAR, SurfaceFigures
from .metrics import SampledSurface, angles, chamfer, shell_iou
from .parallel import Progress, Silent
from .surface import Mesh, Whole


@dataclass(frozen=True)
class Figures:
    """Metrics of a reconstruction against its ground truth. Lengths are in model units."""

    samples: int
    """Number of points on each surface."""
    seed: int
    """Seed of the points."""
    chamfer: float
    """Squared-L2 Chamfer distance, both directions summed."""
    floor: float
    """Chamfer distance of two samplings of the ground truth: the value of a perfect reconstruction."""
    hausdorff: float
    """Largest distance of a sample to the other surface, in both directions."""
    distance_mean: float
    """Mean distance of samples of the reconstruction to the true surface."""
    distance_99: float
    """99th percentile of the same."""
    missing_mean: float
    """Mean distance of samples of the ground truth to the reconstruction."""
    missing_99: float
    """99th percentile of the same."""
    normal_angle: float
    """Mean angle, in degrees, between the normals of a sample's face and of the nearest true face."""
    invented: float
    """Share of the reconstruction that is farther than `FAR` from the true surface."""
    iou: float
    """Intersection over union of shells (`metrics.shell_iou`)."""
    components: int
    """Connected components of the reconstruction."""
    truth_components: int
    """Connected components of the ground truth."""
    watertight: bool
    """Whether the reconstruction is closed (`is_watertight`)."""
    truth_watertight: bool
    """Whether the ground truth is closed."""
    vertices: int
    """Vertices of the reconstruction."""
    faces: int
    """Faces of the reconstruction."""

    def surface(self) -> SurfaceFigures:
        """Return those figures that a training measures, too."""
        return SurfaceFigures(self.distance_mean, self.missing_mean, self.normal_angle, self.invented)


def compare(
    reconstruction: Mesh,
    truth: Mesh,
    samples: int = 500_000,
    seed: int = 0,
    progress: Progress | None = None,
    thickness: float = 0.0,
) -> Figures:
    """Compare a mesh with its ground truth, both in model space.

    samples: number of points on each surface. seed: seed of the points. thickness: distance from the truth that the
    reconstruction has by intention, which does not count as invented.
    """
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
        invented=float((distance > FAR + thickness).mean()),
        iou=iou,
        components=reconstruction.components()[0],
        truth_components=truth.components()[0],
        watertight=is_watertight(reconstruction.faces),
        truth_watertight=is_watertight(truth.faces),
        vertices=len(reconstruction.vertices),
        faces=len(reconstruction.faces),
    )


def is_watertight(faces: Whole) -> bool:
    """Whether each edge of the faces (F, 3) belongs to exactly two faces, in opposite directions."""
    one, other = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    size = int(faces.max()) + 1
    forth, back = np.sort(one * size + other), np.sort(other * size + one)
    return bool((forth == back).all() and (forth[1:] != forth[:-1]).all())
