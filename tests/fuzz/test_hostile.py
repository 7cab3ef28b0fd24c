"""Well-formed inputs with absurd content end in a result or in one line: scenes, maps, cameras, provenance, logs.

As in test_fuzz.py: some hundred cases with a seed that stays the same, 10,000 with a new one among the slow tests, and
those that failed once in tests/fuzz/cases.
"""

import base64
import json
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
import torch
from PIL import Image

from mplicits import cli
from mplicits.bake.registry import TARGETS
from mplicits.capture.folder import read_photographs
from mplicits.capture.options import UnprojectOptions
from mplicits.capture.pairing import pairing_line
from mplicits.capture.rays import rays_of
from mplicits.capture.unprojection import unprojected
from mplicits.field import interpret
from mplicits.field.pack import _limits
from mplicits.ir.lower import lower
from mplicits.model.model_file import load, save, to_bytes
from mplicits.reporting import curves, page
from mplicits.scenes.compose import compose
from mplicits.trainer.finished_networks import resumed, same_training
from mplicits.trainer.settings import Settings
from mplicits.trainer.shapes.demo import DemoShape
from support import hostile
from support.fuzzing import Case, fresh_seed, survive
from support.random_model import random_model

CASES = Path(__file__).parent / "cases"
POINTS = np.random.default_rng(0).uniform(-1, 1, (20, 3)).astype(np.float32)
STILL = random_model((4, 1), (4, 0), texture=(4, 0))


def use_scene(path: Path) -> None:
    """Compose; then the file is readable, targets say all numbers, and the field is finite."""
    save(STILL, path.parent / "part.safetensors")
    model = compose(path)
    save(model, path.with_suffix(".safetensors"))
    assert load(path.with_suffix(".safetensors")).sha256() == model.sha256()
    program = lower(model)
    for time_ in (0.0, 0.37, 1.0):
        with np.errstate(all="ignore"):
            assert np.isfinite(interpret.nested_field(program, POINTS, len(model.levels), time_)[0]).all()
    for target in ("python", "c"):
        assert not re.search(r"\b(inf|nan)[fF]?\b", TARGETS[target](model))


def use_depth_map(path: Path) -> None:
    """Turn the map into a cloud, whose numbers are finite also in the file."""
    case = json.loads(path.read_text())
    depth = path.with_suffix(".npy")
    depth.write_bytes(base64.b64decode(case["map"]))
    given = case["options"]
    if "range" in given:
        given["range"] = tuple(given["range"])
    if case["camera"] is not None:
        camera = path.with_suffix(".k.json")
        camera.write_text(json.dumps(case["camera"]))
        given["intrinsics"] = camera
    cloud = unprojected(UnprojectOptions(depth=depth, **given))
    assert len(cloud.points)
    with np.errstate(all="ignore"):
        for array in (cloud.points, cloud.normals):
            assert np.isfinite(array.astype(np.float32)).all()


def use_cameras(path: Path) -> None:
    """Read a folder of photographs with such cameras, and make their rays."""
    case = json.loads(path.read_text())
    folder = path.with_suffix("")
    layout, masks = case["layout"], case["masks"]
    (folder / "image").mkdir(parents=True)
    if masks:
        (folder / "mask").mkdir()
    frames = []
    matrices: dict[str, Any] = {"scale_mat_0": _matrix(case["scale"])}
    lens = np.array([[20.0, 0, 7.5, 0], [0, 20.0, 7.5, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) @ np.diag(
        [1.0, -1.0, -1.0, 1.0]
    )
    for i, pose in enumerate(case["poses"]):
        name = f"{i}.png"
        place = folder / ("image" if layout == "sphere" else "") / name
        Image.fromarray(np.full((16, 16, 3), 40 * i, np.uint8)).save(place)
        if i < len(masks):
            Image.fromarray(np.full((16, 16), masks[i], np.uint8)).save(folder / "mask" / name)
        frames.append({"file_path": name, "transform_matrix": pose})
        with np.errstate(all="ignore"):
            matrix = _matrix(pose)
            with suppress(ValueError, np.linalg.LinAlgError):
                matrix = lens @ np.linalg.inv(matrix)
            matrices[f"world_mat_{i}"] = matrix
    ball = None if layout == "sphere" else case["sphere"]
    if layout == "sphere":
        np.savez(folder / "cameras_sphere.npz", **matrices)
    else:
        (folder / "transforms.json").write_text(json.dumps(case["lens"] | {"frames": frames}))
    found, _ = read_photographs(folder, sphere=None if ball is None else tuple(ball))
    pairing_line(found)
    found.front()
    rays, _ = rays_of(list(found.views), torch.device("cpu"))
    assert torch.isfinite(rays.directions).all()
    assert torch.isfinite(rays.eyes).all()


def _matrix(value: Any) -> Any:
    """Return a value as an array of numbers; zeros where it is none."""
    try:
        return np.array(value, np.float64)
    except (ValueError, TypeError):
        return np.zeros(3)


def use_provenance(path: Path) -> None:
    """Put the provenance into a model's file, and read it as `info`, `report`, `pack` and `train --resume` do."""
    data = to_bytes(STILL)
    end = 8 + int.from_bytes(data[:8], "little")
    header = json.loads(data[8:end])
    description = header["__metadata__"]["model"].replace('"provenance": {}', f'"provenance": {path.read_text()}')
    assert description != header["__metadata__"]["model"]
    header["__metadata__"]["model"] = description
    text = json.dumps(header).encode()
    path.with_suffix(".safetensors").write_bytes(len(text).to_bytes(8, "little") + text + data[end:])
    model = load(path.with_suffix(".safetensors"))
    assert cli.main(["info", str(path.with_suffix(".safetensors"))]) == 0
    list(page._training(model, None))
    list(page._settings(model))
    _limits(model)
    settings = Settings(networks=((4, 1), (4, 0)), omegas=(30.0, 30.0), steps=(20, 20, 20))
    same_training(model, settings)
    shape = DemoShape()
    shape.source = model.provenance.get("source")  # type: ignore[assignment]
    resumed(model, shape, settings, torch.device("cpu"))


def use_log(path: Path) -> None:
    for stage in curves.read_log(path):
        curves.title_of(stage)
        curves.diagram(stage)


KINDS: dict[str, tuple[Callable[[Random], bytes], Callable[[Path], None], str, int]] = {
    "scene": (hostile.scene, use_scene, ".toml", 60),
    "depth": (hostile.depth_map, use_depth_map, ".json", 100),
    "cameras": (hostile.cameras, use_cameras, ".json", 60),
    "provenance": (hostile.provenance, use_provenance, ".json", 80),
    "log": (hostile.log, use_log, ".jsonl", 40),
}
"""What makes and uses a case of a kind, the ending of its file, and how many the fast test takes."""
FEW_POINTS = 2000
"""Points at which masks and cameras are compared."""
MANY = 20
"""Times the numbers of `KINDS`: 6,800 cases."""


@pytest.fixture(autouse=True)
def few_targets(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let `info` measure one target, whose text is fast to write, and compare masks with cameras at few points."""
    monkeypatch.setattr("mplicits.bake.facts.TARGETS", {"python": TARGETS["python"]})
    monkeypatch.setattr("mplicits.capture.pairing.POINTS", FEW_POINTS)


def cases(kind: str, count: int, seed: int) -> list[Case]:
    make, _, suffix, _ = KINDS[kind]
    random = Random(f"{kind} {seed}")
    return [(f"hostile-{kind}-{seed}-{number}{suffix}", make(random)) for number in range(count)]


@pytest.mark.parametrize("kind", KINDS)
def test_absurd_content_ends_in_a_result_or_one_line(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    _, use, _, count = KINDS[kind]
    assert survive(cases(kind, count, 0), use, tmp_path, CASES) == []


def test_what_failed_once_does_not_fail_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for kind, (_, use, _, _) in KINDS.items():
        kept = [(path.name, path.read_bytes()) for path in sorted(CASES.glob(f"hostile-{kind}-*"))]
        assert survive(kept, use, tmp_path, CASES) == []


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_fresh_absurd_content_ends_in_a_result_or_one_line(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    seed = fresh_seed()
    _, use, _, count = KINDS[kind]
    found = survive(cases(kind, MANY * count, seed), use, tmp_path, CASES)
    assert found == [], f"seed {seed}"
