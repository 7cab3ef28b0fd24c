"""Well-formed inputs with absurd content end in a result or in one line: scenes, maps, cameras, provenance, arguments.

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

import mplicits
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
from mplicits.model.errors import UserError
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
MOVING = random_model((4, 1), (4, 0), inputs="xyzt")


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


def points_named(name: str) -> Any:
    """Return points of hostile.ARGUMENTS."""
    array = POINTS.astype(np.float64)
    tensor = torch.from_numpy(POINTS)
    named: dict[str, Callable[[], Any]] = {
        "grid": lambda: POINTS.reshape(4, 5, 3),
        "lists": array.tolist,
        "empty": lambda: np.zeros((0, 3)),
        "point": lambda: [0, 0, 0],
        "number": lambda: np.array(3.0),
        "text": lambda: "text",
        "texts": lambda: [["1", "2", "3"]],
        "complex": lambda: array + 1j,
        "bools": lambda: array > 0,
        "objects": lambda: array.astype(object),
        "masked": lambda: np.ma.masked_array(array, array > 0.5),
        "dates": lambda: np.zeros((2, 3), "M8[s]"),
        "halves": lambda: array.astype(np.float16),
        "bytes": lambda: array.astype(np.uint8),
        "huge": lambda: array * 1e300,
        "nan": lambda: np.full((2, 3), np.nan),
        "wide": lambda: np.zeros((2, 4)),
        "ragged": lambda: [[1, 2, 3], [4]],
        "none": lambda: None,
        "strided": lambda: np.zeros((4, 6))[:, ::2],
        "fortran": lambda: np.asfortranarray(array),
        "readonly": lambda: np.broadcast_to(array[0], (5, 3)),
        "tensor": lambda: tensor,
        "bf16": tensor.bfloat16,
        "half": tensor.half,
        "int": tensor.int,
        "double": tensor.double,
        "grad": lambda: tensor.clone().requires_grad_(),
        "meta": lambda: tensor.to("meta"),
        "sparse": tensor.to_sparse,
        "quantized": lambda: torch.quantize_per_tensor(tensor, 0.1, 0, torch.qint8),
        "nested": lambda: torch.nested.nested_tensor([tensor, tensor]),
        "inference": torch.inference_mode()(tensor.clone),
        "complex tensor": lambda: tensor + 1j,
        "vmap": lambda: tensor,
        "inside inference": lambda: tensor,
        "no_grad": lambda: tensor.clone().requires_grad_(),
        "expanded": lambda: tensor[:1].expand(7, 3),
        "parameter": lambda: torch.nn.Parameter(tensor.clone()),
    }
    return named[name]()


VALUES: dict[str, dict[str, Any]] = {
    "level": {
        "none": None,
        "true": True,
        "text": "1",
        "1.0": 1.0,
        "numpy": np.int64(1),
        "0-d": np.array(1),
        "nan": np.nan,
        "list": [1],
        "huge": 10**400,
    },
    "time": {
        "nan": np.nan,
        "inf": np.inf,
        "text": "0.5",
        "true": True,
        "0-d": np.array(0.5),
        "list": [0.5],
        "none": None,
        "complex": 0.5j,
        "huge": 10**400,
    },
    "space": {"none": None, "list": ["model"], "number": 3},
}
"""Values of hostile.ARGUMENTS that are neither whole numbers nor texts."""


def use_arguments(path: Path) -> None:
    """Call a function of a field: a result of the right shape, or an error that names the argument."""
    chosen = dict(line.split("=") for line in path.read_text().split("\n"))
    models = {"still": STILL, "moving": MOVING, "plain": random_model((4, 0))}
    if chosen["model"] == "scene":
        save(STILL, path.parent / "part.safetensors")
        (path.parent / "two.toml").write_text('[[parts]]\nmodel = "part.safetensors"\ntranslate = ["t", 0, 0]\n')
        models["scene"] = compose(path.parent / "two.toml")
    field = mplicits.Field(models[chosen["model"]])
    points = points_named(chosen["points"])
    keywords: dict[str, Any] = {}
    for key in ("level", "time", "space"):
        text = chosen[key]
        number = float(text) if re.fullmatch(r"-?[\d.]+", text) and key == "time" else text
        keywords[key] = VALUES[key].get(text, int(text) if re.fullmatch(r"-?\d+", text) and key == "level" else number)
    name = chosen["call"]
    if name == "color":
        del keywords["level"]

    def call(given: Any) -> Any:
        if name == "trace":
            return field.trace(given, [0.0, 0.0, 1.0], **keywords).t
        return getattr(field, name)(given, **keywords)

    try:
        with np.errstate(all="ignore"):
            if chosen["points"] == "vmap":
                torch.func.vmap(call)(points)
            elif chosen["points"] == "inside inference":
                with torch.inference_mode():
                    result = call(points)
                    check_result(name, points, result)
            elif chosen["points"] == "no_grad":
                with torch.no_grad():
                    check_result(name, points, call(points))
            else:
                check_result(name, points, call(points))
    except (UserError, TypeError) as error:
        words = ("points", "level", "time", "space", "origins", "directions")
        if not any(word in str(error) for word in words):
            raise AssertionError(str(error)) from error
        if isinstance(error, TypeError):
            raise UserError(str(error)) from None
        raise


def check_result(name: str, points: Any, result: Any) -> None:
    """Check the shape of a result, and that values and colors are those of the same points as plain arrays."""
    shape = tuple(points.shape) if hasattr(points, "shape") else np.shape(points)
    assert tuple(result.shape) == (shape if name in ("gradient", "color") else shape[:-1])
    if isinstance(points, torch.Tensor) and name != "trace":
        assert result.dtype == torch.float32


def use_options(path: Path) -> None:
    """Make options of a verb with values of any type: they are taken, or refused with the option's name."""
    first, *pairs = path.read_text().split("\n")
    schemas = [verb.options for verb in cli.verbs().values()]
    schema = schemas[int(first) % len(schemas)]
    names = [name for name, each in schema.__dataclass_fields__.items() if each.init]
    required = {name: "x" for name, each in schema.__dataclass_fields__.items() if each.kw_only}
    given: dict[str, Any] = {}
    for pair in pairs:
        name, value = map(int, pair.split())
        given[names[name % len(names)]] = hostile.OPTION_VALUES[value]
    fixed: dict[str, Any] = {
        name: Path(value) if "Path" in str(schema.__dataclass_fields__[name].type) else value
        for name, value in required.items()
    }
    if "checkpoints" in fixed:
        fixed["checkpoints"] = [Path("x")]
    if "estimate" in names and "estimate" not in given:
        fixed["depth"] = "x"
    try:
        options = schema(**fixed | given)
        if hasattr(options, "settings"):
            options.settings()
    except UserError as error:
        said = str(error).replace("-", "_")
        if not any(name in said for name in given):
            raise AssertionError(said) from error
        raise


KINDS: dict[str, tuple[Callable[[Random], bytes], Callable[[Path], None], str, int]] = {
    "scene": (hostile.scene, use_scene, ".toml", 60),
    "depth": (hostile.depth_map, use_depth_map, ".json", 100),
    "cameras": (hostile.cameras, use_cameras, ".json", 60),
    "provenance": (hostile.provenance, use_provenance, ".json", 80),
    "log": (hostile.log, use_log, ".jsonl", 40),
    "arguments": (hostile.arguments, use_arguments, ".txt", 80),
    "options": (hostile.options, use_options, ".txt", 80),
}
"""What makes and uses a case of a kind, the ending of its file, and how many the fast test takes."""
FEW_POINTS = 2000
"""Points at which masks and cameras are compared."""
MANY = 20
"""Times the numbers of `KINDS`: 10,000 cases."""


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
