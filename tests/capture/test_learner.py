"""Training of a scene from photographs, its finish, and the options of `photos`."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from mplicits.capture.distill import FACING, colors_of_surface, surface_of
from mplicits.capture.folder import read_photographs
from mplicits.capture.learner import Learner
from mplicits.capture.options import PhotoOptions
from mplicits.capture.photographs import Photograph
from mplicits.capture.rays import Rays, rays_of
from mplicits.capture.reconstruct import Reconstruction
from mplicits.capture.scene import MultiscaleScene
from mplicits.model.errors import UserError
from mplicits.trainer.progress import TrainingBar
from support.ball_photographs import write_sphere_layout

CPU = torch.device("cpu")


@pytest.fixture
def views(tmp_path: Path) -> tuple[Photograph, ...]:
    """Four small photographs of the ball."""
    write_sphere_layout(tmp_path / "ball", 4, 12)
    return read_photographs(tmp_path / "ball")[0].views


@pytest.fixture
def rays(views: tuple[Photograph, ...]) -> Rays:
    return rays_of(views, CPU)[0]


def test_the_first_step_changes_every_network(rays: Rays) -> None:
    """The fit to the sphere has its own optimizer, which must not disturb the scene's optimizer."""
    scene = MultiscaleScene(((8, 1), (8, 1)), (8.0, 12.0), (0.1,), 8, CPU, 0)
    learner = Learner(scene, rays, 32, 0.0, 0)
    scene.become_sphere(0)
    before = [weight.clone() for weight in scene.levels[0]]
    learner.step(0.1)
    assert all(not torch.equal(old, new) for old, new in zip(before, scene.levels[0], strict=True))


def test_a_wide_radiance_network_has_a_lower_rate(rays: Rays) -> None:
    """The length of Adam's first step is its rate."""
    moved = []
    for width in (32, 64, 128):
        scene = MultiscaleScene(((8, 1),), (8.0,), (), width, CPU, 0)
        before = torch.cat([weight.detach().clone().ravel() for weight in scene.radiance.parameters()])
        Learner(scene, rays, 32, 0.0, 0).step(0.1)
        after = torch.cat([weight.detach().ravel() for weight in scene.radiance.parameters()])
        moved.append(float((after - before).abs().max()))
    assert moved[0] == pytest.approx(moved[1], rel=1e-3)
    assert moved[2] == pytest.approx(moved[1] / 2, rel=1e-3)


def test_surface_colors_average_the_facing_cameras(views: tuple[Photograph, ...]) -> None:
    """A facing camera and the view along the normal have equal weights."""
    scene = MultiscaleScene(((8, 1), (8, 1)), (8.0, 12.0), (0.02,), 8, CPU, 0)
    points = torch.nn.functional.normalize(torch.randn(50, 3, generator=torch.Generator().manual_seed(0)), dim=1) * 0.5
    f, gradient, shade = scene.evaluate(points)
    assert 0 < int((f.abs() < 0.02).sum()) < 50
    normals = torch.nn.functional.normalize(gradient.detach(), dim=1)
    sight = torch.nn.functional.normalize(points - torch.from_numpy(views[0].eye).float(), dim=1)
    facing = (sight * normals).sum(dim=1) < -FACING
    assert 0 < int(facing.sum()) < 50
    everything = torch.arange(50)
    along, seen = (shade(everything, way, gradient).detach() for way in (-normals, sight))
    found = colors_of_surface(points, gradient.detach(), scene.field.features(points), scene.radiance, views[:1])
    torch.testing.assert_close(found, torch.where(facing[:, None], (along + seen) / 2, along))


def test_a_field_without_a_surface_says_which_level_lacks_it() -> None:
    flat = [[torch.zeros(4, 3), torch.zeros(4), torch.zeros(1, 4), torch.ones(1)]]
    with pytest.raises(UserError, match=r"no surface in the photographs \(level 1 has no surface\); check the cameras"):
        surface_of(flat, [0.1])


def test_a_restored_learner_continues_identically(rays: Rays) -> None:

    def start(width: int = 8) -> Learner:
        return Learner(MultiscaleScene(((8, 1), (width, 1)), (8.0, 12.0), (0.1,), 8, CPU, 0), rays, 32, 0.0, 0)

    whole, first, second = start(), start(), start()
    for k in range(6):
        whole.step(0.1 * k)
    for k in range(3):
        first.step(0.1 * k)
    second.restore(first.snapshot())
    for k in range(3, 6):
        second.step(0.1 * k)
    for a, b in zip(whole.snapshot().tensors.values(), second.snapshot().tensors.values(), strict=True):
        torch.testing.assert_close(a, b, rtol=0, atol=0)
    with pytest.raises(UserError, match="another shape"):
        start(width=9).restore(first.snapshot())


def test_photographs_that_miss_the_ball_are_refused(tmp_path: Path) -> None:
    write_sphere_layout(tmp_path / "ball", 3, 12, masks=False)
    with np.load(tmp_path / "ball" / "cameras_sphere.npz") as file:
        matrices: dict[str, Any] = {name: file[name] for name in file.files}
    far = np.diag([1.0, 1.0, 1.0, 1.0])
    far[:3, 3] = 0, 500, 0
    np.savez(tmp_path / "ball" / "cameras_sphere.npz", **matrices | {"scale_mat_0": far})
    photographs, _ = read_photographs(tmp_path / "ball")
    with pytest.raises(UserError, match="no photograph shows the ball"):
        Reconstruction(photographs, PhotoOptions(levels="8x1"), TrainingBar(quiet=True))


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"steps": 5, "seconds": 5}, "not allowed with --seconds"),
        ({"omega": "3"}, "--omega"),
        ({"held_out": 1}, "--held-out 1"),
        ({"background": "green"}, "--background green"),
        ({"scale": 2.0}, "--scale 2"),
        ({"camera_size": "wide"}, "--camera-size wide"),
        ({"sphere": "0,0,0,-1"}, "--sphere"),
        ({"up": "w"}, "--up w"),
        ({"rays": 1}, "--rays 1"),
    ],
)
def test_bad_options_are_refused(options: dict[str, object], match: str) -> None:
    with pytest.raises(UserError, match=match):
        PhotoOptions(**options)  # type: ignore[arg-type]


def test_the_record_of_options_is_json() -> None:
    record = PhotoOptions(sphere="1,2,3,4", camera_size="1600x1200").record()
    assert (record["sphere"], record["camera_size"], record["steps"]) == ([1, 2, 3, 4], [1600, 1200], 6000)
    assert (record["levels"], record["omegas"], record["deltas"]) == ([[64, 2], [128, 2]], [15, 30], [0.08])
    assert PhotoOptions(seconds=9).record()["steps"] is None
