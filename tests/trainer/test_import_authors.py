"""Importing checkpoints as the authors' release writes them: the field, the bands, and the files that are refused."""

from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

from mplicits import cli
from mplicits.field import interpret
from mplicits.ir.lower import lower
from mplicits.model.model import Model, Network
from mplicits.model.model_file import load
from mplicits.trainer.import_authors import read_network
from support import needs
from support.fitted_model import fitted_model
from support.random_model import random_model

MODEL = fitted_model((24, 48))


def write(network: Network, path: Path, omega: float = 1.0, prefix: str = "net") -> Path:
    """Write a checkpoint. omega: divides the weights of all layers but the last, as in *_with_w0.pth."""
    state = OrderedDict()
    for i, layer in enumerate(network):
        factor = 1.0 if i == len(network) - 1 else omega
        state[f"{prefix}.{i}.0.weight"] = torch.from_numpy(layer.weight / np.float32(factor))
        state[f"{prefix}.{i}.0.bias"] = torch.from_numpy(layer.bias / np.float32(factor))
    torch.save(state, path)
    return path


def imported(tmp_path: Path, *argv: str) -> Model:
    output = tmp_path / "m.safetensors"
    assert cli.main(["import", *argv, "-o", str(output)]) == 0
    return load(output)


@pytest.mark.parametrize(
    ("omegas", "names"),
    [
        ((1.0, 1.0), ("best", "weights")),
        ((30.0, 60.0), ("a_with_w0", "b_with_w0")),
    ],
)
def test_an_imported_model_has_the_same_field_and_bands_that_hold_the_surface(
    tmp_path: Path, omegas: tuple[float, float], names: tuple[str, str]
) -> None:
    paths = [
        write(level.network, tmp_path / f"{name}.pth", omega, prefix)
        for level, name, omega, prefix in zip(MODEL.levels, names, omegas, ("net", "net.net"), strict=True)
    ]
    more = [] if omegas == (1.0, 1.0) else ["--omega", "30,60"]
    model = imported(tmp_path, *map(str, paths), *more)
    points = np.random.default_rng(1).normal(size=(500, 3)).astype(np.float32) * 0.4
    for last in (1, 2):
        np.testing.assert_allclose(
            interpret.field(lower(model), points, last), interpret.field(lower(MODEL), points, last), atol=2e-6
        )
    program = lower(model)
    rays = np.random.default_rng(2).normal(size=(2000, 3))
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    low, high = np.full(2000, 0.4), np.full(2000, 1.0)
    for _ in range(30):  # bisection, not the importer's Newton steps
        middle = (low + high) / 2
        inside = interpret.field(program, (rays * middle[:, None]).astype(np.float32), 2) < 0
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    surface = (rays * low[:, None]).astype(np.float32)
    most = np.abs(interpret.field(program, surface, 1)).max()
    assert most < model.levels[0].delta < 1.6 * most
    for number, level in enumerate(model.levels, start=1):
        gradient, _ = interpret.field_gradient(program, surface, number)
        assert np.linalg.norm(gradient, axis=1).max() <= level.lipschitz * 1.001
    assert model.provenance["checkpoints"][0]["file"] == paths[0].name


def test_a_given_shape_sets_the_model_s_space_and_the_deltas(tmp_path: Path) -> None:
    trimesh = needs.package("trimesh")
    ball = trimesh.creation.icosphere(subdivisions=3, radius=3.0)
    ball.apply_translation((1.0, 2.0, 3.0))
    ball.export(tmp_path / "ball.ply")
    path = write(MODEL.levels[0].network, tmp_path / "best.pth")
    model = imported(tmp_path, str(path), "--shape", str(tmp_path / "ball.ply"))
    assert model.scale == pytest.approx(3.0)
    np.testing.assert_allclose(model.center, (1.0, 2.0, 3.0), atol=1e-5)
    vertices = ((ball.vertices - (1.0, 2.0, 3.0)) / 3.0).astype(np.float32)
    expected = 1.3 * np.abs(interpret.field(lower(model), vertices, 1)).max()
    assert model.levels[0].delta == pytest.approx(expected, rel=1e-4)


def changed(network: Network, change: Callable[[torch.Tensor], object], path: Path) -> str:
    """Write a checkpoint whose second weight is changed."""
    state = torch.load(write(network, path), weights_only=True)
    torch.save(state | {"net.1.0.weight": change(state["net.1.0.weight"])}, path)
    return str(path)


@pytest.mark.parametrize(
    "change",
    [
        lambda weight: weight.to("meta"),
        lambda weight: weight.to_sparse(),
        lambda weight: weight.to_sparse_csr(),
        lambda weight: torch.quantize_per_tensor(weight, 0.1, 0, torch.qint8),
        lambda weight: torch.nested.nested_tensor([torch.zeros(2), torch.zeros(3)]),
        lambda weight: weight.to(torch.complex64),
        lambda weight: torch.zeros(1).expand(1 << 20, 1 << 20),
        lambda weight: torch.tensor(1.0),
        lambda weight: weight * torch.nan,
    ],
    ids=["meta", "sparse", "rows", "quantized", "nested", "complex", "huge", "number", "nan"],
)
@pytest.mark.filterwarnings("ignore")
def test_tensors_that_are_no_weights_are_refused_by_name(
    tmp_path: Path, change: Callable[[torch.Tensor], object], capsys: pytest.CaptureFixture[str]
) -> None:
    path = changed(MODEL.levels[0].network, change, tmp_path / "bad.pth")
    assert cli.main(["import", path, "-o", str(tmp_path / "m.safetensors")]) == 2
    assert capsys.readouterr().err.startswith("mplicits: bad.pth: net.1.0.weight: not a weight")


def test_parameters_and_doubles_are_taken(tmp_path: Path) -> None:
    network = MODEL.levels[0].network
    plain = read_network(write(network, tmp_path / "plain.pth"), None)
    for change in (torch.nn.Parameter, torch.Tensor.double):
        other = read_network(Path(changed(network, change, tmp_path / "other.pth")), None)
        for one, two in zip(plain, other, strict=True):
            np.testing.assert_array_equal(one.weight, two.weight)


def test_bad_files_are_refused_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good = str(write(MODEL.levels[0].network, tmp_path / "good.pth"))
    (tmp_path / "noise.pth").write_bytes(b"\0" * 100)
    torch.save({"net.0.0.weight": torch.zeros(4, 3)}, tmp_path / "half.pth")
    torch.save({"model": torch.zeros(4, 3)}, tmp_path / "other.pth")
    torch.save(
        {
            f"net.{i}.0.{kind}": torch.zeros((4, 4) if kind == "weight" else 4)
            for i in (0, 1)
            for kind in ("weight", "bias")
        },
        tmp_path / "wide.pth",
    )
    torch.save({"run": Path("x")}, tmp_path / "code.pth")
    torch.save({f"net.{'9' * 5000}.0.weight": torch.zeros(4, 3)}, tmp_path / "digits.pth")
    write(random_model((1024, 1)).levels[0].network, tmp_path / "huge.pth")
    write(random_model((1, 40)).levels[0].network, tmp_path / "deep.pth")
    lacking = str(write(MODEL.levels[0].network, tmp_path / "best_with_w0.pth"))
    cases = {
        "no such file": [str(tmp_path / "none.pth")],
        "noise.pth: not a checkpoint": [str(tmp_path / "noise.pth")],
        "half.pth: no layers": [str(tmp_path / "half.pth")],
        "other.pth: model": [str(tmp_path / "other.pth")],
        "wide.pth: ": [str(tmp_path / "wide.pth")],
        "code.pth: not a checkpoint": [str(tmp_path / "code.pth")],
        "digits.pth: net.999": [str(tmp_path / "digits.pth")],
        "huge.pth: 1,054,721 weights in 3 layers": [str(tmp_path / "huge.pth")],
        "weights in 42 layers": [str(tmp_path / "deep.pth")],
        "--omega": [lacking],
        "--omega: 1 of 2": [good, good, "--omega", "30"],
        "good.pth: level 1 has no surface": [good, "--omega", "1e-6"],
    }
    for reason, argv in cases.items():
        assert cli.main(["import", *argv, "-o", str(tmp_path / "m.safetensors")]) == 2, reason
        error = capsys.readouterr().err
        assert reason in error
        assert len(error.splitlines()) == 1
        assert not (tmp_path / "m.safetensors").exists()
