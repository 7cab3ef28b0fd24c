"""`mplicits render`: the picture, the printed line, and errors."""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mplicits import cli
from mplicits.codegen.targets.uniforms import SHADINGS
from mplicits.model.errors import UserError
from mplicits.model.model_file import save
from mplicits.viewer.cli import VERBS
from mplicits.viewer.draw.compile import compile_quickly, storage_for
from mplicits.viewer.draw.context import Context, open_context
from mplicits.viewer.draw.screenshot import save_png
from mplicits.viewer.options import SHADES, PictureOptions
from support.fitted_model import fitted_model
from support.paths import ROOT
from support.random_model import random_model


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("models") / "ball.safetensors"
    save(fitted_model(), path)
    return path


def parse(*arguments: object) -> argparse.Namespace:
    """Return the arguments of `mplicits render` as its parser understands them."""
    verb = next(verb for verb in VERBS if verb.name == "render")
    parser = argparse.ArgumentParser()
    verb.arguments(parser)
    return parser.parse_args([str(argument) for argument in arguments])


def render(*arguments: object) -> None:
    """Run `mplicits render` with these arguments; errors are raised, not printed."""
    verb = next(verb for verb in VERBS if verb.name == "render")
    verb.run(parse(*arguments))


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
def test_the_default_output_is_named_after_the_model(
    model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    render(model, "--size", 8, "--context", "osmesa", "--samples", 1)
    assert [path.name for path in tmp_path.iterdir()] == ["ball.png"]


@pytest.mark.usefixtures("osmesa")
@pytest.mark.parametrize(
    "arguments",
    [
        ("--camera", "10,80"),
        ("--camera", "-30,-20,2.5"),
        ("--shade", "steps"),
        ("--iterations", "12,3"),
        ("--background", "ffffff"),
        ("--background", "#102030,#a0b0c0"),
        ("--light", "-1,1,1"),
        ("--storage", "texture"),
    ],
)
def test_options_change_the_picture_where_they_should(model: Path, tmp_path: Path, arguments: tuple[str, ...]) -> None:
    pictures = []
    for i, added in enumerate(((), arguments)):
        render(model, "-o", tmp_path / f"{i}.png", "--size", 32, "--context", "osmesa", "--samples", 1, *added)
        pictures.append(np.asarray(Image.open(tmp_path / f"{i}.png"), float))
    same = np.abs(pictures[0] - pictures[1]).max() <= 2
    assert same == ("--storage" in arguments or "--iterations" in arguments)


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


def test_a_split_picture_shows_level_1_and_all_levels(model: Path, tmp_path: Path) -> None:
    for name, levels in (("explicit", ("--level", 1, "--normal-level", 2)), ("default", ())):
        arguments = ("--size", 32, "--context", "osmesa", "--samples", 1, "--split", *levels)
        render(model, "-o", tmp_path / f"{name}.png", *arguments)
    explicit, default = (np.asarray(Image.open(tmp_path / f"{name}.png")) for name in ("explicit", "default"))
    assert np.array_equal(explicit, default)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ("--camera 1", "2 or 3 numbers joined by commas"),
        ("--camera 1,2,3,4", "2 or 3 numbers"),
        ("--iterations 5,x", "whole numbers"),
        ("--samples many", "invalid int value"),
    ],
)
def test_text_of_another_type_is_refused(arguments: str, word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["render", "m.safetensors", *arguments.split()]) == 2
    assert word in capsys.readouterr().err


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


def test_the_texture_of_a_model_without_one_is_refused(tmp_path: Path) -> None:
    save(random_model((4, 0)), tmp_path / "m.safetensors")
    with pytest.raises(UserError, match="no texture"):
        render(tmp_path / "m.safetensors", "--shade", "texture")


def test_the_choices_are_those_of_the_shaders_and_of_the_contexts() -> None:
    assert sorted([*SHADES, "data"]) == sorted(SHADINGS)
    contexts = PictureOptions.__dataclass_fields__["context"].metadata["declaration"].choices
    with pytest.raises(UserError, match=f"none of {', '.join(contexts)}$"):
        open_context("vulkan")


def test_a_missing_model_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such file"):
        render(tmp_path / "m.safetensors")


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


def test_declaring_the_verbs_imports_no_package_and_render_never_imports_torch(
    model: Path, tmp_path: Path, osmesa: Context
) -> None:
    assert osmesa.software
    code = f"""
import sys
from mplicits.viewer.cli import VERBS
print([name for name in ("numpy", "moderngl", "PIL", "glfw", "torch") if name in sys.modules])
import argparse
parser = argparse.ArgumentParser()
VERBS[0].arguments(parser)
arguments = [{str(model)!r}, "-o", {str(tmp_path / "a.png")!r}, "--size", "8", "--context", "osmesa", "--json"]
VERBS[0].run(parser.parse_args(arguments))
print([name for name in ("torch", "scipy", "trimesh", "glfw") if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    lines = done.stdout.splitlines()
    assert (lines[0], lines[-1]) == ("[]", "[]"), done.stderr


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
    said = capsys.readouterr()
    assert json.loads(said.out)["coverage"] == 0
    assert "the camera is inside it" in said.err
    assert len(said.err.splitlines()) == 1
    assert cli.main(arguments) == 0
    assert not capsys.readouterr().err
