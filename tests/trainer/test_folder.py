"""`train` on a folder: jobs, results, failures, resuming."""

import csv
import os
import signal
import subprocess
import sys
import time
from argparse import ArgumentParser
from dataclasses import replace
from pathlib import Path

import pytest
import trimesh

from mplicits import cli
from mplicits.model.errors import UserError
from mplicits.model.model_file import load
from mplicits.model.verb import add_arguments, read
from mplicits.trainer.checkpoint import CheckpointFile
from mplicits.trainer.commands import TrainCommand
from mplicits.trainer.folder import shape_options, shapes_in
from mplicits.trainer.folders.job import Job, Outcome, Runner, Status
from mplicits.trainer.folders.results import PAGE, TABLE, row_of, write_results
from support.paths import DEMO

SMALL = ("--levels", "12x0,12x1", "--texture", "none", "--steps", "30,30", "--seed", "3")


@pytest.fixture
def shapes(tmp_path: Path) -> Path:
    folder = tmp_path / "shapes"
    folder.mkdir()
    trimesh.creation.icosphere(2).export(folder / "ball.ply")
    trimesh.creation.torus(1.0, 0.4).export(folder / "ring & <b>.stl")
    (folder / "bad.obj").write_text("nonsense")
    (folder / "notes.txt").write_text("no shape")
    return folder


def rows(folder: Path) -> dict[str, dict[str, str]]:
    with (folder / TABLE).open(newline="") as file:
        return {row["name"]: row for row in csv.DictReader(file)}


def test_models_have_unique_names_from_their_files(shapes: Path) -> None:
    assert set(shapes_in(shapes)) == {"ball", "bad", "ring & <b>"}
    trimesh.creation.box().export(shapes / "ball.obj")
    assert set(shapes_in(shapes)) == {"ball-ply", "ball-obj", "bad", "ring & <b>"}


@pytest.mark.parametrize(
    "argv",
    [
        [],
        [*SMALL, "--packed", "--weights", "eikonal=2,value=1e5"],
        ["--seconds", "2.5", "--flat", "--up", "-y", "--front", "-30,20", "--credit", "A 'B', C"],
        ["--omega", "20,30", "--noise", "0.01", "--thicken", "0.1", "--texture-network", "8x1", "--device", "cpu"],
    ],
)
def test_each_shape_gets_the_options_of_the_folder(argv: list[str]) -> None:
    parser = ArgumentParser()
    add_arguments(parser, TrainCommand)

    def parsed(*arguments: str) -> TrainCommand:
        command = read(TrainCommand, parser.parse_args(arguments))
        assert isinstance(command, TrainCommand)
        return command

    options = parsed("folder", "-o", "out", "--jobs", "2", "--resume", "--quiet", *argv)
    again = parsed("folder", *shape_options(options))
    assert again == replace(options, output=None, jobs=1, resume=False, quiet=False)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ([], "name one for its models with -o, or add --time"),
        (["-o", "file.txt"], "it is not a folder"),
        (["-o", "full"], "holds 1 of these models; --resume"),
        (["-o", "out", "--live"], "--live"),
        (["-o", "out", "--jobs", "0"], "--jobs 0"),
        (["-o", "out", "--levels", "0x9"], "--levels"),
        (["-o", "theirs"], "theirs/ball.png: it exists and is not a picture that mplicits wrote; move it away"),
        (["-o", "theirs", "--force"], "theirs/ball.png: it exists and is not a picture"),
        (["-o", "page", "--force"], "page/index.html: it exists and is not a page of models"),
        (["-o", "table", "--force"], "table/models.csv: it exists and is not a table of models"),
    ],
)
def test_a_bad_option_is_one_line_and_writes_nothing(
    more: list[str], said: str, shapes: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(shapes.parent)
    Path("file.txt").write_text("mine")
    Path("full").mkdir()
    Path("full", "ball.safetensors").write_bytes(DEMO.read_bytes())
    for folder, name in (("theirs", "ball.png"), ("page", "index.html"), ("table", "models.csv")):
        Path(folder).mkdir()
        Path(folder, name).write_bytes(b"\x89PNG\r\n\x1a\n of a user")
    before = sorted(Path().rglob("*"))
    assert cli.main(["train", "shapes", *more]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert sorted(Path().rglob("*")) == before


def test_an_empty_folder_and_jobs_for_a_single_shape_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["train", str(tmp_path), "-o", str(tmp_path / "out")]) == 2
    assert "no shapes in that folder" in capsys.readouterr().err
    assert cli.main(["train", "ball.ply", "--jobs", "2"]) == 2
    assert "for a folder" in capsys.readouterr().err


def test_table_and_page_escape_names_and_list_failures(tmp_path: Path) -> None:
    (tmp_path / "a<b>&.safetensors").write_bytes(DEMO.read_bytes())

    def job(name: str) -> Job:
        return Job(name, f"/x/{name}.ply", str(tmp_path / f"{name}.safetensors"), (), False, 0)

    outcomes = [
        Outcome(job("a<b>&"), Status.TRAINED, 1.0),
        Outcome(job("worse"), Status.FAILED, 2.0, "worse.ply: <script>alert(1)</script>"),
        Outcome(job("gone"), Status.TRAINED, 3.0),
    ]
    write_results(tmp_path, [row_of(outcome) for outcome in outcomes], "three & <more>", 4)
    table, page = rows(tmp_path), (tmp_path / PAGE).read_text()
    assert [row["status"] for row in table.values()] == ["trained", "failed", "failed"]
    demo = load(DEMO)
    assert int(table["a<b>&"]["parameters"]) == demo.parameters()
    assert float(table["a<b>&"]["mean_f"]) == pytest.approx(demo.provenance["levels"][-1]["mean_f"], rel=1e-3)
    assert "cannot read the model" in table["gone"]["reason"]
    assert "<script>" not in page
    assert "a<b>" not in page
    assert "a&lt;b&gt;&amp;" in page
    assert "a%3Cb%3E%26.safetensors" in page
    assert "4 to come" in page


def test_a_trained_model_whose_rendering_fails_says_why_it_has_no_picture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A `mplicits` of the test's own: `train` copies the demo, `render` complains."""
    package = tmp_path / "path" / "mplicits"
    package.mkdir(parents=True)
    (package / "__init__.py").touch()
    (package / "__main__.py").write_text(
        "import shutil, sys\n"
        f"if sys.argv[1] == 'train': shutil.copy({str(DEMO)!r}, sys.argv[4])\n"
        "else: sys.exit('mplicits: no OpenGL here')\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(package.parent))
    job = Job("ball", "/x/ball.ply", str(tmp_path / "ball.safetensors"), (), False, 0)
    outcome = Runner(lambda *_: None).run(job)
    assert (outcome.status, outcome.reason) == (Status.TRAINED, "no picture: no OpenGL here")
    row = row_of(outcome)
    assert row.status is Status.TRAINED
    write_results(tmp_path, [row], "one", 0)
    assert rows(tmp_path)["ball"]["reason"] == "no picture: no OpenGL here"
    assert "no OpenGL here" in (tmp_path / PAGE).read_text()


@pytest.mark.slow
def test_a_folder_trains_good_shapes_names_bad_ones_and_resumes(
    shapes: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    argv = ["train", str(shapes), "-o", str(out), "--jobs", "2", "--quiet", *SMALL]
    assert cli.main(argv) == 0
    assert "bad: failed: bad.obj" in capsys.readouterr().out
    table = rows(out)
    assert {name: row["status"] for name, row in table.items()} == {
        "bad": "failed",
        "ball": "trained",
        "ring & <b>": "trained",
    }
    assert (out / "ball.png").read_bytes().startswith(b"\x89PNG")
    first = load(out / "ball.safetensors")
    assert first.provenance["settings"]["seed"] == 3
    (out / "ring & <b>.safetensors").unlink()
    trimesh.creation.box().export(shapes / "bad.obj")
    assert cli.main([*argv, "--resume"]) == 0
    assert {name: row["status"] for name, row in rows(out).items()} == {
        "bad": "trained",
        "ball": "kept",
        "ring & <b>": "trained",
    }
    assert load(out / "ball.safetensors").sha256() == first.sha256()


@pytest.mark.slow
@pytest.mark.usefixtures("usual_signals")
def test_sigterm_stops_the_trainings_of_a_program_that_ignores_ctrl_c(shapes: Path, tmp_path: Path) -> None:
    """As nohup or a script in the background starts it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    (shapes / "bad.obj").unlink()
    out = tmp_path / "out"
    command = [sys.executable, "-m", "mplicits", "train", str(shapes), "-o", str(out), *SMALL[:4], "--steps", "1000000"]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL) as process:
        while not (out / TABLE).exists():
            assert process.poll() is None
            time.sleep(0.1)
        time.sleep(1)
        process.send_signal(signal.SIGINT)
        time.sleep(1)
        assert process.poll() is None, "it ignores Ctrl-C"
        process.send_signal(signal.SIGTERM)
        try:
            assert process.wait(60) == 128 + signal.SIGTERM
        finally:
            process.kill()


def test_a_shape_with_the_name_of_a_checkpoint_gets_another(shapes: Path) -> None:
    """The training of ball.ply writes and removes ball.part.safetensors."""
    trimesh.creation.box().export(shapes / "ball.part.ply")
    assert "ball.part-ply" in shapes_in(shapes)
    with pytest.raises(UserError, match="that is the name of a checkpoint"):
        CheckpointFile(shapes / "ball.part.safetensors", print)


def test_names_that_are_no_text_or_a_formula_reach_table_and_page(tmp_path: Path) -> None:
    names = ("=cmd()", "@x", os.fsdecode(b"caf\xe9"))
    jobs = [Job(name, f"/x/{name}.ply", str(tmp_path / f"{name}.safetensors"), (), False, 0) for name in names]
    for job in jobs:
        Path(job.output).write_bytes(DEMO.read_bytes())
    write_results(tmp_path, [row_of(Outcome(job, Status.TRAINED, 1.0)) for job in jobs], names[-1], 0)
    table, page = rows(tmp_path), (tmp_path / PAGE).read_text()
    assert [row["shape"] for row in table.values()] == ["'=cmd().ply", "'@x.ply", "caf\\udce9.ply"]
    assert 'href="caf%E9.safetensors"' in page
