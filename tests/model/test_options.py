"""One schema declares the options of the command line, of a Python function, and their checks."""

import inspect
from argparse import ArgumentParser
from dataclasses import dataclass
from pathlib import Path

import pytest

from mplicits.model.errors import UserError
from mplicits.model.options import Options, argument, option, takes
from mplicits.model.verb import add_arguments, command_line, read


@dataclass(frozen=True)
class Drawing(Options):
    """A schema with a field of each type."""

    size: int = option(512, "pixels", metavar="N", least=8, most=4096)
    shade: str = option("phong", "shading", choices=("phong", "normal"), old={"gouraud": "phong"})
    no_cull: bool = option(False, "keep all 100%", excludes="scale")
    camera: tuple[float, float] | tuple[float, float, float] | None = option(None, "angles")
    steps: tuple[int, ...] | None = option(None, "steps", least=1)
    scale: float | None = option(None, "factor", above=0, most=1)
    levels: str | list[str] | None = option(None, "levels")
    mesh: Path | None = option(None, "mesh")


@dataclass(frozen=True)
class Command(Drawing):
    """The options that only the command line has."""

    model: Path = argument("M", "model", Path)
    more: Path | None = argument("MORE", "more", default=None)


def parsed(*argv: str) -> Command:
    parser = ArgumentParser(exit_on_error=False)
    add_arguments(parser, Command)
    command = read(Command, parser.parse_args(argv))
    assert isinstance(command, Command)
    return command


def test_an_earlier_name_of_a_choice_works_with_a_note(capsys: pytest.CaptureFixture[str]) -> None:
    assert Drawing(shade="gouraud").shade == parsed("m", "--shade", "gouraud").shade == "phong"
    assert capsys.readouterr().err == 2 * "mplicits: note: --shade gouraud is now --shade phong\n"
    with pytest.raises(UserError, match=r"choose from phong, normal$"):
        Drawing(shade="flat")


def test_the_command_line_reads_each_type_and_writes_it_again() -> None:
    assert parsed("m") == Command(model=Path("m"))
    argv = ["--size=8", "--no-cull", "--camera=-30,20,2.5", "--steps=20,5", "--levels=8x0,8x1", "--mesh=a.ply"]
    command = parsed("m", "n", *argv)
    assert (command.camera, command.steps, command.more) == ((-30, 20, 2.5), (20, 5), Path("n"))
    assert command_line(command, Drawing) == argv
    assert parsed("m", "--camera", "-30,20").camera == (-30, 20)


@pytest.mark.parametrize("argv", [["--camera=1"], ["--camera=1,2,3,4"], ["--steps=5,x"], ["--size=many"]])
def test_text_of_another_type_is_refused(argv: list[str]) -> None:
    with pytest.raises((SystemExit, Exception), match=argv[0].partition("=")[0]):
        parsed("m", *argv)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"size": 7}, "--size 7: a whole number from 8 to 4,096 is needed"),
        ({"shade": "toon"}, "--shade toon: choose from phong, normal"),
        ({"scale": 0.0}, "--scale 0: a number above 0, at most 1 is needed"),
        ({"scale": float("nan")}, "--scale nan: "),
        ({"camera": (0.0, float("inf"))}, "--camera inf: a finite number is needed"),
        ({"steps": (5, 0)}, "--steps 0: a whole number from 1 is needed"),
        ({"no_cull": True, "scale": 0.5}, "--no-cull: not allowed with --scale"),
    ],
)
def test_values_that_do_not_fit_are_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(UserError, match=message):
        Drawing(**options)  # type: ignore[arg-type]


def test_a_python_function_has_the_options_as_keywords() -> None:
    @takes(Drawing)
    def draw(model: str, options: Drawing) -> tuple[str, Drawing]:
        """Draw a model."""
        return model, options

    assert draw("m", 16, shade="normal") == ("m", Drawing(16, "normal"))
    assert list(inspect.signature(draw).parameters)[:3] == ["model", "size", "shade"]
    assert "shade: shading" in str(draw.__doc__)
    with pytest.raises(TypeError, match="unexpected keyword"):
        draw("m", color=1)  # type: ignore[call-arg]
    with pytest.raises(UserError, match="--size 1"):
        draw("m", 1)


def test_a_function_says_how_to_install_what_it_lacks(monkeypatch: pytest.MonkeyPatch) -> None:
    @takes(Drawing)
    def mesh(options: Drawing) -> None:
        raise ModuleNotFoundError("No module named 'igl'", name="igl")

    monkeypatch.setattr("mplicits.model.extras.find_spec", lambda module: None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'mplicits\[mesh\]' \(220 MB\)"):
        mesh()
