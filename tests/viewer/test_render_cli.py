"""`mplicits render`: the picture, the printed line, and errors."""

import argparse
import json
import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from mplicits import cli
from mplicits.codegen.targets.uniforms import SHADINGS
from mplicits.model.errors import UserError
from mplicits.model.model_file import save
from mplicits.viewer.cli import VERBS
from mplicits.viewer.draw.compile import compile_quickly, storage_for
from mplicits.viewer.draw.context import open_context
from mplicits.viewer.draw.screenshot import save_png
from mplicits.viewer.options import SHADES, PictureOptions
from support.fitted_model import fitted_model
from support.random_model import random_model


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("models") / "ball.safetensors"
    save(fitted_model(), path)
    return path


def render(*arguments: object) -> None:
    """Run `mplicits render` with these arguments; raises errors instead of printing them."""
    parser = argparse.ArgumentParser()
    VERBS[0].arguments(parser)
    VERBS[0].run(parser.parse_args([str(argument) for argument in arguments]))


def small_picture(path: Path, model: Path, *arguments: object) -> NDArray[np.float64]:
    """Return a picture that `mplicits render` draws with these arguments."""
    render(model, "-o", path, "--size", 32, "--context", "osmesa", "--samples", 1, "--force", *arguments)
    return np.asarray(Image.open(path), float)


@pytest.mark.usefixtures("osmesa")
def test_render_writes_the_picture_and_prints_one_line(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "a.png"
    render(model, "-o", picture, "--size", "40x24", "--context", "osmesa")
    image = Image.open(picture)
    assert (image.size, image.mode) == ((40, 24), "RGB")
    assert image.info["Title"] == "fitted"
    pixels = np.asarray(image, float)
    assert np.abs(pixels[12, 20] - pixels[0, 0]).max() > 30, "a shape in the middle, background in the corner"
    line = capsys.readouterr().out
    assert line.count("\n") == 1
    assert all(word in line for word in (str(picture), "40x24", "osmesa", "compiled in", "drawn in"))


@pytest.mark.usefixtures("osmesa")
def test_json_reports_the_coverage_of_a_transparent_picture(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "a.png"
    render(model, "-o", picture, "--size", 24, "--context", "osmesa", "--transparent", "--json", "--level", 1)
    report = json.loads(capsys.readouterr().out)
    assert (report["output"], report["width"], report["level"], report["normal_level"]) == (str(picture), 24, 1, 1)
    image = Image.open(picture)
    assert image.mode == "RGBA"
    alpha = np.asarray(image)[..., 3] / 255
    assert alpha[0, 0] == 0
    assert alpha[12, 12] == 1
    assert abs(alpha.mean() - report["coverage"]) < 0.01


@pytest.mark.usefixtures("osmesa")
def test_json_reports_the_samples_that_were_drawn(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    means = []
    for samples in ("1", "3", "3 --uniform"):
        render(model, "-o", tmp_path / "a.png", *f"--size 24 --force --json --samples {samples}".split())
        means.append(json.loads(capsys.readouterr().out)["mean_samples"])
    assert means[0] == 1 < means[1] < 2
    assert means[2] == 3


@pytest.mark.usefixtures("osmesa")
def test_the_default_output_is_named_after_the_model(
    model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    render(model, "--size", 8, "--context", "osmesa", "--samples", 1)
    assert [path.name for path in tmp_path.iterdir()] == ["ball.png"]


@pytest.mark.slow
@pytest.mark.usefixtures("osmesa")
def test_options_change_the_picture(model: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    default = small_picture(path, model)
    for arguments, changes in (
        ("--camera -30,-20,2.5", True),
        ("--shade steps", True),
        ("--background #102030,#a0b0c0", True),
        ("--light -1,1,1", True),
        ("--iterations 12,3 --storage texture", False),
    ):
        picture = small_picture(path, model, *arguments.split())
        assert (np.abs(picture - default).max() > 2) == changes, arguments
    split = small_picture(path, model, "--split")
    assert np.array_equal(split, small_picture(path, model, "--split", "--level", 1, "--normal-level", 2))


@pytest.mark.parametrize(
    ("storage", "rays", "parameters", "software", "chosen"),
    [
        ("auto", 256 * 256, 21_893, True, "texture"),
        ("auto", 512 * 512 * 4, 21_893, True, "mixed"),
        ("auto", 2048 * 2048 * 4, 21_893, True, "auto"),
        ("auto", 1024 * 1024 * 4, 8_501, True, "auto"),
        ("auto", 256 * 256 * 4, 21_893, False, "auto"),
        ("literal", 1, 21_893, True, "literal"),
    ],
)
def test_software_gl_compiles_literals_for_many_rays(
    storage: str, rays: int, parameters: int, software: bool, chosen: str
) -> None:
    assert storage_for(storage, rays, parameters, software) == chosen


def test_mesa_compiles_quickly_unless_the_user_sets_its_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GALLIVM_PERF", "no_quad_lod")
    compile_quickly()
    assert os.environ["GALLIVM_PERF"] == "no_quad_lod"
    monkeypatch.delenv("GALLIVM_PERF")
    compile_quickly()
    assert os.environ["GALLIVM_PERF"] == "nopt"


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ("--size 10x", "WxH"),
        ("--size axb", "WxH"),
        ("--size -5", "WxH"),
        ("--size 0x4", "each side"),
        ("--background red", "RRGGBB"),
        ("--shade toon", "choose from phong"),
        ("--context x", "choose from auto"),
        ("--level 3", "levels 1 to 2"),
        ("--fov 0", "field of view"),
        ("--camera 0,0,0", "distance"),
        ("--camera 0,nan", "finite"),
        ("--samples 0", "--samples 0"),
        ("--iterations 1,2,3", "2 levels"),
        ("-o no/such/folder.png", "does not exist"),
        ("-o a.jpg", ".png"),
        ("--benchmark 0", "--benchmark 0: a whole number from 1"),
    ],
)
def test_bad_values_are_refused_before_any_work(model: Path, arguments: str, word: str) -> None:
    with pytest.raises(UserError, match=word) as raised:
        render(model, *arguments.split())
    assert "\n" not in str(raised.value)


def test_missing_models_and_textures_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "m.safetensors"
    with pytest.raises(UserError, match="no such file"):
        render(path)
    save(random_model((4, 0)), path)
    with pytest.raises(UserError, match="no texture"):
        render(path, "--shade", "texture")


def test_the_choices_are_those_of_the_shaders_and_of_the_contexts() -> None:
    assert sorted([*SHADES, "data"]) == sorted(SHADINGS)
    contexts = PictureOptions.__dataclass_fields__["context"].metadata["declaration"].choices
    with pytest.raises(UserError, match=f"none of {', '.join(contexts)}$"):
        open_context("vulkan")


@pytest.mark.parametrize("name", ['"/*', "</script>", "a\nb", "é\u2028漢", "x" * 300])
def test_the_model_s_name_is_the_title_of_the_picture(tmp_path: Path, name: str) -> None:
    save_png(tmp_path / "a.png", np.zeros((2, 3, 4), np.float32), name)
    image = Image.open(tmp_path / "a.png")
    assert image.size == (3, 2)
    assert image.info["Title"] == name


def test_pixels_are_rounded_and_clipped(tmp_path: Path) -> None:
    values = np.array([-1.0, 0.0, 0.4 / 255, 0.6 / 255, 1.0, 7.0], np.float32)
    save_png(tmp_path / "a.png", np.repeat(values[None, :, None], 4, axis=2))
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "a.png"))[0, :, 0], [0, 0, 0, 1, 255, 255])


@pytest.mark.usefixtures("osmesa")
def test_benchmark_prints_the_median_rate_of_its_frames(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save(random_model((4, 0)), tmp_path / "m.safetensors")
    path = tmp_path / "m"
    argv = f"render {path}.safetensors -o {path}.png --size 16 --context osmesa --benchmark 3".split()
    assert cli.main([*argv, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["frames_per_second"] > 0
    assert cli.main(argv) == 0
    assert "frames per second, median of 3" in capsys.readouterr().out


def test_a_camera_inside_the_shape_gets_a_note(model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["render", str(model), "-o", str(tmp_path / "m.png"), "--size", "32", "--json"]
    assert cli.main([*arguments, "--camera", "30,20,0.01"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["coverage"] == 0
    assert "the camera is inside it" in err
    assert len(err.splitlines()) == 1
    assert cli.main(arguments) == 0
    assert not capsys.readouterr().err
