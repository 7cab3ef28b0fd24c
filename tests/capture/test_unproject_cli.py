"""`mplicits unproject`: files, options and errors."""

import io
import json
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mplicits import cli
from mplicits.model import memory
from mplicits.trainer.shapes.load import load_shape
from support import needs

SIDE = 64


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with a depth map (millimeters) of a bump before a wall, and its picture."""
    x = np.linspace(-1, 1, SIDE)
    square = x**2 + x[:, None] ** 2
    depth = np.where(square < 0.5, 1.5 - 0.4 * np.sqrt(np.maximum(0.5 - square, 0)), 2.5)
    Image.fromarray(np.rint(depth * 1000).astype(np.uint16)).save(tmp_path / "depth.png")
    colors = np.zeros((2 * SIDE, 2 * SIDE, 4), np.uint8)
    colors[..., 0], colors[..., 3] = 200, np.repeat(np.repeat(255 * (square < 0.5), 2, 0), 2, 1)
    Image.fromarray(colors).save(tmp_path / "photo.png")
    Image.fromarray(colors[..., 3]).save(tmp_path / "mask.png")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_train_loads_the_cloud_of_unproject(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The picture's wall is transparent."""
    argv = ["unproject", "depth.png", "--image", "photo.png", "--fov", "40", "-o", "c.ply", "--json"]
    assert cli.main(argv) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["points"] > 1000
    assert facts["colors"] is True
    assert facts["size"] == [SIDE, SIDE]
    shape, warnings = load_shape("c.ply")
    assert warnings == []
    assert shape.colored
    points = shape.surface(500, np.random.default_rng(0), colors=True)
    assert points.colors is not None
    assert abs(points.colors - [200 / 255, 0, 0]).max() < 0.03
    assert (points.normals[:, 2] > 0).mean() > 0.99
    assert (folder / "c.ply").stat().st_size > 27 * facts["points"]


@pytest.mark.parametrize(
    "options",
    [
        ("--mask", "mask.png"),
        ("--range", "1,2"),
        ("--unit", "500", "--range", "2,4"),
        ("--mask", "mask.png", "--ray"),
        ("--mask", "mask.png", "--relative"),
        ("--mask", "mask.png", "--close"),
    ],
)
def test_options_select_the_bump(options: tuple[str, ...], folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["unproject", "depth.png", "--fov", "40", "--json", *options]) == 0
    facts = json.loads(capsys.readouterr().out)
    bump = (np.asarray(Image.open(folder / "mask.png").resize((SIDE, SIDE))) > 0).sum()
    assert 0.6 * bump < facts["points"] < (2 if "--close" in options else 1) * bump
    assert facts["output"] == "depth.ply"


def test_an_unknown_camera_causes_a_warning(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["unproject", "depth.png"]) == 0
    out, err = capsys.readouterr()
    assert err == "warning: camera unknown; assuming 50 degrees from top to bottom (--fov, --intrinsics)\n"
    assert "points with normals, without colors; noise 0." in out
    assert "at depth edges" in out


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("argv", "said"),
    [
        ((), "name a depth map, or a photograph with --estimate"),
        (("depth.png", "--estimate", "photo.png"), "and not both"),
        (("missing.png",), "missing.png: no such file"),
        (("depth.png", "--image", "missing.png"), "--image missing.png: no such file"),
        (("depth.png", "--image", "depth.ply"), "--image depth.ply: no such file"),
        (("depth.png", "-o", "cloud.obj"), "cloud.obj: clouds are PLY"),
        (("depth.png", "-o", "photo.png"), "photo.png: clouds are PLY"),
        (("depth.png", "--range", "2,1"), "--range 2,1: two numbers"),
        (("depth.png", "--range", "10,20"), "no depth lies within --range"),
        (("depth.png", "--unit", "0"), "--unit 0"),
        (("depth.png", "--fov", "200"), "--fov 200"),
        (("depth.png", "--fov", "40", "--intrinsics", "k.json"), "not allowed with"),
        (("depth.png", "--intrinsics", "k.json"), "k.json: No such file"),
        (("depth.png", "--mask", "wide.png"), "the views differ"),
        (("depth.png", "--mask", "black.png"), "no pixel with a depth is left"),
    ],
)
def test_bad_input_is_one_line(argv: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    Image.new("L", (2 * SIDE, SIDE), 255).save("wide.png")
    Image.new("L", (SIDE, SIDE), 0).save("black.png")
    assert cli.main(["unproject", *argv]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err
    assert len(err.splitlines()) == 1
    assert not list(Path().glob("*.ply"))


@pytest.mark.slow
def test_a_network_estimates_the_depth_of_a_photograph(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A tiny Depth Anything with random weights, saved like the real ones."""
    transformers = needs.package("transformers")
    torch = needs.package("torch")
    torch.manual_seed(0)
    backbone = transformers.Dinov2Config(
        hidden_size=16, num_hidden_layers=2, num_attention_heads=2, image_size=56, patch_size=14, apply_layernorm=True,
        out_indices=[1, 2], reshape_hidden_states=False,
    )  # fmt: skip
    config = transformers.DepthAnythingConfig(
        backbone_config=backbone, reassemble_hidden_size=16, reassemble_factors=[2, 1], neck_hidden_sizes=[8, 16],
        fusion_hidden_size=8, head_hidden_size=8,
    )  # fmt: skip
    model = transformers.DepthAnythingForDepthEstimation(config)
    for weights in model.parameters():
        torch.nn.init.normal_(weights, std=0.3)
    torch.nn.init.constant_(model.head.conv3.bias, 9.0)
    model.save_pretrained(folder / "tiny")
    transformers.DPTImageProcessor(
        size={"height": 56, "width": 56}, keep_aspect_ratio=True, ensure_multiple_of=14
    ).save_pretrained(folder / "tiny")
    argv = ["unproject", "--estimate", "photo.png", "--estimator", "tiny", "--fov", "40", "-o", "c.ply", "--json"]
    code = cli.main(argv)
    out, err = capsys.readouterr()
    assert code == 0, err
    facts = json.loads(out.splitlines()[-1])
    assert facts["size"] == [2 * SIDE, 2 * SIDE]
    assert facts["points"] > 50
    assert load_shape("c.ply")[0].colored


@pytest.mark.slow
@pytest.mark.usefixtures("folder")
def test_a_bad_estimator_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    needs.package("transformers")
    Path("empty").mkdir()
    assert cli.main(["unproject", "--estimate", "photo.png", "--estimator", "empty", "-o", "c.ply"]) == 2
    err = capsys.readouterr().err
    assert "--estimator empty: a folder that cannot be loaded" in err
    assert len(err.splitlines()) == 1


@pytest.mark.slow
@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("file", ["config.json", "preprocessor_config.json"])
def test_an_estimator_runs_no_code_of_its_own(
    file: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its configuration names a Python file beside it; somebody would answer every question with yes."""
    needs.package("transformers")
    Path("theirs").mkdir()
    names = ("AutoConfig", "AutoModelForDepthEstimation", "AutoImageProcessor")
    own = {"model_type": "their_own", "auto_map": dict.fromkeys(names, "theirs.Theirs")}
    usual = {"model_type": "depth_anything"} if file != "config.json" else {}
    Path("theirs", "config.json").write_text(json.dumps(usual or own))
    Path("theirs", file).write_text(json.dumps(own))
    Path("theirs", "theirs.py").write_text("open('ran', 'w')\nclass Theirs: pass\n")
    monkeypatch.setattr("builtins.input", lambda *_: "y")
    assert cli.main(["unproject", "--estimate", "photo.png", "--estimator", "theirs", "-o", "c.ply"]) == 2
    out, err = capsys.readouterr()
    assert (out, len(err.splitlines())) == ("", 1)
    assert "--estimator theirs: a folder that cannot be loaded" in err
    assert not Path("ran").exists()
    from transformers.dynamic_module_utils import resolve_trust_remote_code

    with pytest.raises(ValueError, match="custom code"):  # of a model that a configuration names
        resolve_trust_remote_code(None, "another", has_local_code=False, has_remote_code=True)
    long = "x" * 300
    assert cli.main(["unproject", "--estimate", "photo.png", "--estimator", long, "-o", "c.ply"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


@pytest.mark.usefixtures("folder")
def test_a_large_map_is_refused_before_its_pixels_are_read(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Maps of 13,000 x 13,000 pixels whose pixels are missing: no reader comes that far."""
    monkeypatch.setattr(memory, "free_memory", lambda: 4e9)
    small = io.BytesIO()
    Image.new("I;16", (13, 13)).save(small, "PNG")
    head = small.getvalue()[:16] + (13_000).to_bytes(4, "big") * 2 + small.getvalue()[24:29]
    Path("d.png").write_bytes(head + zlib.crc32(head[12:]).to_bytes(4, "big") + small.getvalue()[33:])
    np.save("d.npy", np.zeros((9, 9), np.uint16))
    data = Path("d.npy").read_bytes()
    Path("d.npy").write_bytes(data.replace(b"(9, 9), }        ", b"(13000, 13000), }"))
    with Path("d.npy").open("ab") as file:
        file.truncate(2 * 13_000**2 + 128)  # a hole
    for name in ("d.png", "d.npy"):
        assert cli.main(["unproject", name, "-o", "c.ply"]) == 2
        err = capsys.readouterr().err
        assert "a depth map of 13000 x 13000 needs some" in err
        assert len(err.splitlines()) == 1
    Image.new("L", (3000, 3000), 255).save("wide.png")
    monkeypatch.setattr(memory, "free_memory", lambda: 1e8)
    assert cli.main(["unproject", "depth.png", "--mask", "wide.png"]) == 2
    assert "--mask wide.png needs some 0.22 GB of memory" in capsys.readouterr().err


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("row.npy",), "only 16 x 1 pixels have a depth"),
        (("pixel.npy",), "only 1 x 1 pixels have a depth"),
        (("tiny.npy",), "no pixel has a depth"),
        (("huge.npy",), "no pixel has a depth"),
        (("bump.npy", "--intrinsics", "far.json"), "far.json: the focal lengths must be above 0, and no number"),
        (("bump.npy", "--relative", "--range", "1e299,2e299"), "no depth is from 1e-15 to 1e+15"),
        (("whole.npy", "--unit", "1e-290"), "no depth is from 1e-15 to 1e+15"),
    ],
)
def test_depths_at_the_edges_are_one_line(more: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    bump = 2 + 0.1 * np.hypot(*np.indices((16, 16)) - 8.0)
    row, pixel = np.zeros((16, 16)), np.zeros((16, 16))
    row[3], pixel[3, 3] = 1, 1
    for name, values in {"row": row, "pixel": pixel, "tiny": bump * 1e-320, "huge": bump * 1e300, "bump": bump}.items():
        np.save(f"{name}.npy", values)
    np.save("whole.npy", (100 * bump).astype(np.uint16))
    Path("far.json").write_text(json.dumps({"fx": 1e300, "fy": 1e300, "cx": 8, "cy": 8}))
    assert cli.main(["unproject", *more, "-o", "c.ply"]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert len(err.splitlines()) == 1
    assert not Path("c.ply").exists()


def test_a_library_in_c_says_nothing_beside_the_error(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    openexr = needs.package("OpenEXR")
    header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
    depth = np.random.default_rng(0).random((64, 64)).astype(np.float32)
    openexr.File(header, {"Z": depth}).write("d.exr")
    Path("d.exr").write_bytes(Path("d.exr").read_bytes()[:-3000])
    assert cli.main(["unproject", "d.exr", "-o", "c.ply"]) == 2
    assert capfd.readouterr().err == "mplicits: d.exr: not a readable EXR file\n"


def test_the_default_name_overwrites_clouds_that_mplicits_wrote_alone(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["unproject", "depth.png"]) == 0
    assert cli.main(["unproject", "depth.png"]) == 0
    scan = b"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n"
    Path("depth.ply").write_bytes(scan)
    assert cli.main(["unproject", "depth.png"]) == 2
    assert "is not a PLY that mplicits wrote" in capsys.readouterr().err
    assert Path("depth.ply").read_bytes() == scan
