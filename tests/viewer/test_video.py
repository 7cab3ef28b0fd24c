"""`mplicits render --time` and `--frames`: videos of moving models, and turns around other models."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageSequence

from mplicits.cli import main
from mplicits.codegen.targets.glsl330 import bake
from mplicits.model.model import Model
from mplicits.model.model_file import save
from mplicits.viewer.draw import movie
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.options import RenderOptions
from mplicits.viewer.draw.renderer import Renderer
from support import needs
from support.fitted_model import fitted_model
from support.moving_model import moving_model

SIZE = (36, 24)


@pytest.fixture(scope="module")
def model() -> Model:
    return moving_model()


@pytest.fixture(scope="module")
def folder(model: Model, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a moving model and a rigid one."""
    path = tmp_path_factory.mktemp("models")
    save(model, path / "moving.safetensors")
    save(fitted_model((8, 16)), path / "rigid.safetensors")
    return path


@pytest.fixture(scope="module")
def renderer(osmesa: Context, model: Model) -> Renderer:
    return Renderer(osmesa, bake(model, "texture"))


def pictures(path: Path) -> list[NDArray[np.float64]]:
    """Return the pictures of a video, each (H, W, 3) in [0, 1]."""
    if path.suffix == ".gif":
        with Image.open(path) as gif:
            assert gif.info["loop"] == 0
            return [np.asarray(frame.convert("RGB"), float) / 255 for frame in ImageSequence.Iterator(gif)]
    av = needs.package("av")
    with av.open(str(path)) as video:
        return [picture.to_ndarray(format="rgb24") / 255 for picture in video.decode(video=0)]


def render(folder: Path, name: str, *arguments: object) -> int:
    words = ["render", folder / f"{name}.safetensors", "--size", "x".join(map(str, SIZE)), "--context", "osmesa"]
    return main([str(word) for word in (*words, "--samples", 1, *arguments)])


def nearest(picture: NDArray[np.float64], candidates: list[NDArray[np.float32]]) -> int:
    """Return the index of the candidate (H, W, 4) nearest to a picture."""
    return int(np.argmin([np.abs(picture - candidate[..., :3]).mean() for candidate in candidates]))


def test_a_video_of_a_motion_shows_each_moment(
    folder: Path, renderer: Renderer, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "motion.mp4"
    assert render(folder, "moving", "--frames", 6, "--fps", 15, "-o", path, "--json") == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["frames"], report["fps"], report["time"]) == (6, 15, None)
    shown = pictures(path)
    assert len(shown) == 6
    times = [0.0, 0.25, 0.75, 1.0]
    expected = [renderer.render(SIZE, Camera(aspect=1.5), RenderOptions(time=time)) for time in times]
    assert [nearest(picture, expected) for picture in shown] == [0, 1, 2, 3, 2, 1]
    assert all(np.abs(picture - expected[0][..., :3]).mean() < 0.03 for picture in shown[:1])
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_once_plays_the_motion_once_and_turn_turns_the_camera(folder: Path, renderer: Renderer, tmp_path: Path) -> None:
    path = tmp_path / "once.gif"
    assert render(folder, "moving", "--frames", 3, "--once", "--turn", 90, "-o", path) == 0
    ends = [
        renderer.render(SIZE, Camera(aspect=1.5).orbited(turn, 0), RenderOptions(time=time))
        for time in (0.0, 0.5, 1.0)
        for turn in (0.0, 30.0, 60.0)
    ]
    assert [nearest(picture, ends) for picture in pictures(path)] == [0, 4, 8]


def test_a_video_of_a_rigid_model_is_one_turn(osmesa: Context, folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "turn.gif"
    assert render(folder, "rigid", "--frames", 4, "-o", path) == 0
    own = Renderer(osmesa, bake(fitted_model((8, 16)), "texture"))
    sides = [own.render(SIZE, Camera(aspect=1.5).orbited(90.0 * k, 0), RenderOptions()) for k in range(4)]
    own.release()
    assert [nearest(picture, sides) for picture in pictures(path)] == [0, 1, 2, 3]


def test_a_gif_keeps_its_rate_in_hundredths_of_a_second() -> None:
    gif = movie.Gif(30)
    for k in range(6):
        gif.add(np.full((4, 5, 3), k / 6, np.float32))
    with Image.open(io.BytesIO(gif.data())) as image:
        durations = [frame.info["duration"] for frame in ImageSequence.Iterator(image)]
    assert (sum(durations), set(durations)) == (200, {30, 40})


def test_time_chooses_the_moment_of_a_picture(folder: Path, renderer: Renderer, tmp_path: Path) -> None:
    assert render(folder, "moving", "--time", 0.75, "-o", tmp_path / "a.png") == 0
    drawn = np.asarray(Image.open(tmp_path / "a.png"), float) / 255
    times = [0.0, 0.5, 0.75, 1.0]
    expected = [renderer.render(SIZE, Camera(aspect=1.5), RenderOptions(time=time)) for time in times]
    assert nearest(drawn, expected) == 2
    assert np.abs(drawn - expected[2][..., :3]).max() < 0.02


@pytest.mark.parametrize(
    ("name", "words", "message"),
    [
        ("rigid", "--time 0.5", "fitted does not move"),
        ("moving", "--time 1.5", "--time 1.5: a number from 0 to 1"),
        ("moving", "--time nan", "a number from 0 to 1"),
        ("moving", "--frames 4 --time 0.5", "--frames shows all of them"),
        ("moving", "--frames 0", "--frames 0: a whole number"),
        ("moving", "--frames 4 --fps 0", "--fps 0: a whole number from 1 to 60"),
        ("moving", "--frames 4 --turn nan", "--turn nan"),
        ("moving", "--fps 10 --once", "--fps, --once: of a video; it needs --frames N"),
        ("moving", "--frames 4 --transparent", "--transparent: of a single picture"),
        ("moving", "--frames 4 --mesh nothing.ply", "does not move as the model does"),
        ("rigid", "--frames 4 --once", "does not move"),
        ("moving", "--frames 4 -o a.png", "name it .mp4 or .gif"),
        ("moving", "-o a.gif", "a video needs --frames N"),
        ("moving", "--frames 4 -o a.mp4 --size 31x20", "even numbers"),
        ("moving", "--frames 4 -o there.gif", "it exists and is not a video"),
    ],
)
def test_bad_options_of_videos_are_one_line(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    name: str,
    words: str,
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.gif").write_text("a letter")
    assert render(folder, name, *words.split()) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line
    assert [file.name for file in tmp_path.iterdir()] == ["there.gif"]


def test_ctrl_c_leaves_no_video(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = iter((None, None, KeyboardInterrupt))
    render_tile = Renderer.render_tile

    def interrupted(*arguments: object) -> object:
        if stop := next(drawn):
            raise stop
        return render_tile(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(Renderer, "render_tile", interrupted)
    assert render(folder, "moving", "--frames", 5, "-o", tmp_path / "motion.gif") == 130
    assert list(tmp_path.iterdir()) == []
