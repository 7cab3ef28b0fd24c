"""The gallery: models that are called by name where a file is expected, small enough to travel with the package."""

import argparse
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from mplicits import cli
from mplicits.field.interpret import color, nested_field
from mplicits.ir.lower import lower
from mplicits.model import gallery
from mplicits.model.model import Model
from mplicits.model.model_file import load, save
from mplicits.model.verb import add_arguments, read
from mplicits.trainer.options import CREASE
from mplicits.trainer.shapes.load import load_shape
from mplicits.trainer.shapes.shape import Doubles, Shape, SurfacePoints
from mplicits.viewer.cli import RenderCommand, ViewCommand
from mplicits.viewer.draw.camera import Camera
from support import needs
from support.paths import DATA
from support.random_model import random_model

FOLDER = gallery.FOLDER
SIZES = ("-small", "", "-large")
NAMES = [name + size for name in ("spot", "bob") for size in SIZES]
MESHES = {"spot": "spot.obj", "bob": "bob_tri.obj"}
MOVING = "spot-to-bob"
MOST = 1_500_000
TEXTURED = DATA / "textured"


@cache
def curved_shape(file: str) -> Shape:
    """Load a mesh as `train` does."""
    return load_shape(str(TEXTURED / file), crease=CREASE)[0]


def assert_near(
    model: Model, surface: SurfacePoints, points: Doubles, time: float = 0.0, *, exact: bool = False
) -> None:
    """Fail unless a model is 0 and has the right colors on a surface. points: of the surface, in model space."""
    program, at = lower(model), points.astype(np.float32)
    value, reached = nested_field(program, at, len(model.levels), time)
    assert (reached == len(model.levels)).mean() > 0.999
    assert np.abs(value).mean() < (1e-3 if exact else 3e-3)
    assert surface.colors is not None
    assert ((color(program, at, time) - surface.colors) ** 2).mean() < (0.003 if exact else 0.02)


def test_the_gallery_has_two_shapes_in_three_sizes() -> None:
    assert gallery.names() == sorted([*NAMES, MOVING])
    assert sum(path.stat().st_size for path in FOLDER.iterdir() if path.is_file()) <= MOST
    for name in ("spot", "bob"):
        small, middle, large = (load(gallery.model_path(name + size)).parameters() for size in SIZES)
        assert small < middle < large


@pytest.mark.parametrize("name", NAMES)
def test_models_are_textured_and_say_where_they_come_from(name: str) -> None:
    model = load(gallery.model_path(name))
    assert model.texture is not None
    assert model.name == name, "pages and windows show the name"
    assert model.provenance["source"]["file"] == MESHES[name.partition("-")[0]]
    assert not model.provenance["interrupted"]
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert f"-o model/gallery/{name}.safetensors" in text
    assert model.provenance["source"]["sha256"] in text
    assert all(word in text for word in ("Keenan Crane", "CC0"))


@needs.data(TEXTURED)
@pytest.mark.parametrize("name", NAMES)
def test_models_are_the_meshes_and_their_colors(name: str) -> None:
    shape = curved_shape(MESHES[name.partition("-")[0]])
    surface = shape.surface(4000, np.random.default_rng(1), colors=True)
    model = load(gallery.model_path(name))
    assert model.provenance["source"] == shape.source, "curved, as `train` takes a mesh"
    points = surface.points * shape.scale + shape.center
    assert_near(model, surface, (points - model.center) / model.scale, exact=not name.endswith("small"))


@needs.data(TEXTURED)
@pytest.mark.parametrize("time", [0.0, 1.0])
def test_the_motion_goes_from_one_mesh_to_the_other(time: float) -> None:
    model = load(gallery.model_path(MOVING))
    assert (model.name, model.inputs, model.provenance["interrupted"]) == (MOVING, "xyzt", False)
    assert f"-o model/gallery/{MOVING}.safetensors" in (FOLDER / "README.md").read_text(encoding="utf-8")
    moment = model.provenance["source"]["moments"][int(time)]
    shape = curved_shape(moment["file"])
    assert moment["sha256"] == shape.source["sha256"]
    surface = shape.surface(4000, np.random.default_rng(1), colors=True)
    assert_near(model, surface, surface.points, time)


def test_a_user_s_file_comes_before_a_model_of_the_gallery(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert gallery.model_path("spot") == FOLDER / "spot.safetensors"
    assert gallery.model_path("nobody") == Path("nobody")
    assert gallery.model_path("./spot") == Path("spot")
    Path("spot").mkdir()
    assert gallery.model_path("spot") == FOLDER / "spot.safetensors", "a folder is no model"
    Path("spot").rmdir()
    Path("spot").write_bytes(b"")
    assert gallery.model_path("spot") == Path("spot"), "the gallery hides no file of the user"


@pytest.mark.parametrize("verb", ["info", "bake", "render", "view", "mesh"])
def test_every_verb_that_takes_a_model_takes_a_name(verb: str) -> None:
    parser = argparse.ArgumentParser()
    cli.verbs()[verb].arguments(parser)
    assert parser.parse_args(["spot"]).model == FOLDER / "spot.safetensors"


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("schema", [RenderCommand, ViewCommand])
def test_the_camera_starts_at_the_front_of_a_model(
    name: str, schema: type[RenderCommand | ViewCommand], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As their meshes do, Spot faces -z, which is azimuth 180, and Bob faces -x, which is azimuth 270."""
    monkeypatch.chdir(tmp_path)
    parser = argparse.ArgumentParser()
    add_arguments(parser, schema)

    def camera(*argv: str) -> Camera:
        command = read(schema, parser.parse_args(argv))
        camera = command.view_from(load(command.model).front)
        assert isinstance(camera, Camera)
        return camera

    spot_or_bob, (width, height) = camera(name), schema(model=Path()).pixels
    assert 0 < abs(spot_or_bob.azimuth - (180 if name.startswith("spot") else 270)) <= 60
    assert spot_or_bob.distance is None
    assert camera(name, "--camera", "1,2,3") == Camera(1, 2, 3, aspect=width / height)
    save(random_model((4, 0)), Path("m.safetensors"))
    assert camera("m.safetensors") == Camera(aspect=width / height), "no front: the usual view"


def test_a_name_works_on_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.main(["bake", "spot-small", "--target", "c"]) == 0
    assert "spot_small_color(" in Path("spot-small.c").read_text(encoding="utf-8")
    assert cli.main(["info", "spott"]) == 2
    assert (
        capsys.readouterr().err.splitlines()[-1]
        == "mplicits: spott: no such file; did you mean 'spot', of the gallery?"
    )
