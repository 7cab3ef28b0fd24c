"""The command line: the packages it loads, its output, its exit codes."""

import json
import os
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from tqdm import tqdm

from mplicits import cli
from mplicits.model import extras
from mplicits.model.errors import UserError
from mplicits.model.image_file import png_bytes
from mplicits.model.model_file import save
from mplicits.model.options import Options
from mplicits.model.verb import Verb
from support import needs
from support.paths import DEMO, ROOT
from support.random_model import random_model

HEAVY = {"numpy", "safetensors", "PIL", "moderngl", "glfw", "tqdm", "scipy", "trimesh", "igl", "torch"}
LOADED = """
import json, sys
from mplicits import cli
print(json.dumps([cli.main(sys.argv[1:]), *sys.modules]))
"""


def loaded(*argv: str) -> set[str]:
    """Return the packages of HEAVY that `mplicits ARGV` loads in a process of its own."""
    done = subprocess.run([sys.executable, "-c", LOADED, *argv], capture_output=True, text=True, cwd=ROOT, check=True)
    code, *modules = json.loads(done.stdout.splitlines()[-1])
    assert code == 0, done.stderr
    return HEAVY & set(modules)


@pytest.fixture
def model(tmp_path: Path) -> str:
    """A small model file."""
    save(random_model((4, 0)), tmp_path / "m.safetensors")
    return str(tmp_path / "m.safetensors")


@pytest.mark.parametrize("argv", [(), ("--version",), ("train", "--help")])
def test_help_loads_nothing_heavy(argv: tuple[str, ...]) -> None:
    """Every call imports the options of all verbs."""
    assert not loaded(*argv)


@pytest.mark.usefixtures("osmesa")
def test_verbs_load_what_they_need(model: str, tmp_path: Path) -> None:
    assert loaded("info", model) == {"numpy", "safetensors"}
    assert loaded("bake", model, "-o", str(tmp_path / "m.glsl")) == {"numpy", "safetensors"}
    argv = ("render", model, "-o", str(tmp_path / "m.png"), "--size", "8x8", "--samples", "1", "--context", "osmesa")
    assert not loaded(*argv) & {"glfw"}.union(*(extra.modules for extra in extras.EXTRAS.values()))


def test_the_help_lists_every_verb_and_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main([]) == 0
    out = capsys.readouterr().out
    assert cli.main(["--help"]) == 0
    assert out == capsys.readouterr().out
    assert cli.EXAMPLE in out
    listed = [line.split()[0] for line in out.splitlines() if line.startswith("    ")]
    assert [verb for verb in listed if verb in cli.verbs()] == list(cli.verbs())
    assert {"demo", "train", "info", "bake", "render", "view"} <= set(listed)


@pytest.mark.parametrize(
    "argv",
    [
        ("bake", "{model}", "-o", "{model}"),
        ("mesh", "{model}", "-o", "{link}"),
        ("render", "{model}", "-o", "{link}"),
        ("train", "{model}", "-o", "{link}"),
        ("train", "shape.obj", "--texture", "{model}", "-o", "{model}"),
        ("import", "{model}", "-o", "{model}"),
    ],
)
def test_inputs_are_not_overwritten(
    argv: tuple[str, ...], model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = Path(model).read_bytes()
    link = tmp_path / ("link.ply" if argv[0] == "mesh" else "link.png")
    link.hardlink_to(model)
    assert cli.main([part.format(model=model, link=link) for part in argv]) == 2
    assert "it is the input; name another file" in capsys.readouterr().err
    assert Path(model).read_bytes() == before


@pytest.mark.parametrize(
    ("argv", "output"),
    [
        (("train", "{model}"), "notes.txt"),
        (("import", "{model}"), "other.safetensors"),
        (("bake", "{model}"), "{model}.glsl"),
        (("mesh", "{model}"), "picture.ply"),
        (("render", "{model}"), "picture.png"),
    ],
)
def test_only_force_overwrites_a_file_of_another_kind(
    argv: tuple[str, ...], output: str, model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With --force all but `bake` still fail, since their inputs do not exist."""
    path = tmp_path / output.format(model=Path(model).name)
    path.write_text("something else\n")
    command = [*(part.format(model=model) for part in argv), "-o", str(path)]
    if argv[0] in {"train", "import"}:
        command[1] = str(tmp_path / "missing.obj")
    assert cli.main(command) == 2
    assert "it exists and is not a" in (line := capsys.readouterr().err)
    assert len(line.splitlines()) == 1
    assert path.read_text() == "something else\n"
    if argv[0] in {"train", "import"}:
        assert cli.main([*command, "--force"]) == 2
        assert "no such file" in capsys.readouterr().err
    elif argv[0] == "bake":
        assert cli.main([*command, "--force"]) == cli.main(command) == 0, "an earlier output may be written over"


def test_images_that_a_mesh_names_are_not_overwritten(
    model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The name in the material has other capitals, and mplicits wrote the image."""
    mesh, picture = tmp_path / "m.obj", tmp_path / "skin.png"
    ball = trimesh.creation.icosphere(1)
    uv = "\n".join(f"vt {x} {y}" for x, y, _ in ball.vertices)
    faces = "\n".join("f " + " ".join(f"{i}/{i}" for i in face + 1) for face in ball.faces)
    vertices = "\n".join("v {} {} {}".format(*point) for point in ball.vertices)
    mesh.write_text(f"mtllib a b.mtl\n{vertices}\n{uv}\nusemtl m\n{faces}\n")
    (tmp_path / "a b.mtl").write_text("newmtl m\nmap_Kd -s 1 1 1 SKIN.PNG\n")
    before = png_bytes(np.zeros((4, 4, 3), np.uint8))
    picture.write_bytes(before)
    bare = tmp_path / "bare.obj"
    bare.write_text(mesh.read_text().replace("mtllib a b.mtl\n", ""))
    for argv in (
        ["render", model, "--mesh", str(mesh), "--size", "8x8"],
        ["train", str(mesh), "--force"],
        ["check", str(mesh)],
        ["check", str(bare), "--texture", str(picture)],
    ):
        assert cli.main([*argv, "-o", str(picture)]) == 2
        assert "it is the input" in capsys.readouterr().err.splitlines()[-1]
        assert picture.read_bytes() == before


def test_help_all_lists_the_options_for_studies(capsys: pytest.CaptureFixture[str]) -> None:
    listed = {}
    for flag in ("--help", "--help-all"):
        assert cli.main(["train", flag]) == 0
        listed[flag] = capsys.readouterr().out
    assert ("--omega" in listed["--help"], "--omega" in listed["--help-all"]) == (False, True)
    assert "\nshape:\n" in listed["--help"]


@pytest.mark.parametrize("name", cli.verbs())
def test_the_help_of_a_verb_ends_with_a_valid_example(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    verb = cli.verbs()[name]
    assert cli.main([name, "--help"]) == 0
    assert capsys.readouterr().out.endswith(f"example: mplicits {verb.example}\n")
    parser = cli.Parser()
    verb.arguments(parser)
    first, *rest = verb.example.split()
    assert first == name
    parser.parse_args(rest)


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["trian", "x.ply"], "no verb 'trian'; did you mean 'train'?"),
        (["xyz"], "no verb 'xyz'; see mplicits --help"),
        (["a\nb"], "no verb 'a\\nb'"),
        (["--nonsense"], "--nonsense (see mplicits --help)"),
        (["info"], "(see mplicits info --help)"),
        (["info", "a", "b\nc"], "unrecognized arguments: b\\nc"),
        (["render", "m", "--size", "b\ni\ng"], "--size"),
        (["bake", "m", "--digits", "many"], "--digits"),
        (["info", "no\nsuch.safetensors"], "no\\nsuch.safetensors: no such file"),
        (["info", "n" * 5000], "nnn: File name too long"),
        (["info", "\udcff.safetensors"], "\\udcff.safetensors: no such file"),
        (["demo", "--out-dir", "/dev/null/a\nb"], "/dev/null/a\\nb: Not a directory"),
        *(
            (argv, "an empty name; a path is needed")
            for argv in (["gallery", ""], ["train", ""], ["mesh", "spot", "-o", ""])
        ),
    ],
)
def test_user_errors_are_one_line(argv: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(argv) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("mplicits: ")
    assert message in err
    assert len(err.splitlines()) == 1


@pytest.fixture
def failing(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Return a function that replaces all verbs by `fail`, which raises an exception."""

    def prepare(error: BaseException, extra: str = "train") -> None:
        def work(_: Options) -> None:
            raise error

        verb = Verb("fail", "fails", Options, "fail", work, extra)
        monkeypatch.setattr("mplicits.cli.verbs", lambda: {"fail": verb})

    return prepare


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (UserError("two\nlines"), 2, "two\\nlines"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (
            ModuleNotFoundError(name="no_such_package.inside"),
            2,
            "the package 'no_such_package' is missing; run: pip install no_such_package",
        ),
        (MemoryError(), 2, "out of memory: close other programs, or ask for less (a lower resolution, a smaller file)"),
    ],
)
def test_exit_codes(
    error: BaseException,
    code: int,
    message: str,
    failing: Callable[[BaseException], None],
    capsys: pytest.CaptureFixture[str],
) -> None:
    failing(error)
    assert cli.main(["fail"]) == code
    assert capsys.readouterr().err == f"mplicits: {message}\n"


@pytest.mark.parametrize(
    ("extra", "module"), [(name, module) for name, extra in extras.EXTRAS.items() for module in sorted(extra.modules)]
)
def test_a_missing_package_names_the_extra_that_brings_it(
    extra: str,
    module: str,
    failing: Callable[..., None],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    failing(ModuleNotFoundError(name=module), extra)
    assert cli.main(["fail"]) == 2
    size = extras.EXTRAS[extra].size
    line = f"mplicits: this needs the package '{module}'; run: pip install 'mplicits[{extra}]' ({size})\n"
    assert capsys.readouterr().err == line


def test_the_script_run_installs_a_missing_extra_and_repeats_the_command(
    failing: Callable[..., None], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Replaced(BaseException):
        """Stands for os.execv, which does not return."""

    def execv(path: str, argv: list[str]) -> None:
        raise Replaced(path, *argv)

    monkeypatch.setitem(sys.modules, "torch", None)
    monkeypatch.setenv(extras.RUN, "/there/run")
    monkeypatch.setattr(os, "execv", execv)
    failing(ModuleNotFoundError(name="torch"), "train")
    with pytest.raises(Replaced) as replaced:
        cli.main(["fail"])
    assert replaced.value.args == ("/there/run", "/there/run", "--install", "train", "fail")
    size = extras.EXTRAS["train"].size
    assert capsys.readouterr().err == f"mplicits: 'fail' needs more packages; installing {size} (once)\n"


def test_the_verbs_that_read_meshes_ask_for_the_mesher_s_extra() -> None:
    extras_of_verbs = {name: verb.extra for name, verb in cli.verbs().items()}
    assert {name for name, extra in extras_of_verbs.items() if extra == "mesh"} == {"check", "mesh", "eval", "report"}
    # Options of `unproject` and `train`, and some formats, need the others; the verbs themselves do not.
    assert {*extras_of_verbs.values(), "depth", "formats", "meshopt"} == set(extras.EXTRAS)


@pytest.mark.parametrize(
    "error",
    [
        ValueError("a bug"),
        ModuleNotFoundError(name="mplicits.codegen.nothing"),
        ModuleNotFoundError(name="json.nothing"),
        ModuleNotFoundError(name="numpy.nothing"),
    ],
)
def test_a_bug_keeps_its_traceback(error: Exception, failing: Callable[[BaseException], None]) -> None:
    failing(error)
    with pytest.raises(type(error)) as caught:
        cli.main(["fail"])
    assert caught.value is error


@pytest.mark.parametrize(
    ("command", "code", "message"),
    [
        ("--version > /dev/full", 2, "mplicits: cannot write to the standard output: No space left on device\n"),
        ("--version >&-", 0, ""),
        ("--version 2>&-", 0, ""),
        ("info {model} | true", 141, ""),
        ("bake {model} --target cuda -o /dev/stdout | head -c 1 > /dev/null", 141, ""),
    ],
)
def test_closed_and_full_outputs(command: str, code: int, message: str, model: str) -> None:
    script = f"set -o pipefail; {sys.executable} -m mplicits {command.format(model=model)}"
    done = subprocess.run(["bash", "-c", script], stderr=subprocess.PIPE, text=True, cwd=ROOT, check=False)
    assert (done.returncode, done.stderr) == (code, message)


def test_a_stack_that_is_too_small_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    before = resource.getrlimit(resource.RLIMIT_STACK)
    try:
        resource.setrlimit(resource.RLIMIT_STACK, (256 << 10, before[1]))
        assert cli.main(["--version"]) == 2
    finally:
        resource.setrlimit(resource.RLIMIT_STACK, before)
    assert capsys.readouterr().err == "mplicits: the stack is limited to 256 kB; run: ulimit -s 1024\n"


def test_an_error_takes_the_place_of_open_bars(capsys: pytest.CaptureFixture[str]) -> None:
    bar = tqdm(total=3, desc="reading", ncols=40)
    bar.update()
    cli.fail("a line", 2)
    assert bar.disable
    *_, last = capsys.readouterr().err.split("\r")
    assert last == "mplicits: a line\n"


@pytest.mark.parametrize(
    "error", [MemoryError(), RuntimeError("[enforce fail] can't allocate memory: 12 bytes"), RuntimeError("other")]
)
def test_memory_that_ends_is_one_line_in_pytorch_too(
    error: Exception, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(_: object) -> None:
        raise error

    monkeypatch.setattr(cli, "perform", fail)
    if str(error) == "other":
        with pytest.raises(RuntimeError, match="other"):
            cli.main([])
        return
    assert cli.main([]) == 2
    assert capsys.readouterr().err.startswith("mplicits: out of memory: close other programs")


AS_OTHERS = """
import ctypes, os, sys
if not os.getuid():  # root reads everything, except without these two capabilities
    drop = 24  # PR_CAPBSET_DROP; the capabilities are CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH
    for capability in (1, 2):
        ctypes.CDLL(None).prctl(drop, capability, 0, 0, 0)
os.execv(sys.executable, [sys.executable, *sys.argv[1:]])
"""
"""Runs Python such that it reads no file that its mode forbids, as root, too."""


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (["check", "theirs.ply"], "theirs.ply: permission denied"),
        (["check", "theirs.obj"], "theirs.obj: permission denied"),
        (["info", "theirs.safetensors"], "theirs.safetensors: permission denied"),
        (["train", "folder", "-o", "out"], "folder: Permission denied"),
    ],
)
def test_files_without_permission_to_read_are_one_line(argv: list[str], said: str, tmp_path: Path) -> None:
    for name in ("theirs.ply", "theirs.obj"):
        trimesh.creation.icosphere(1).export(tmp_path / name)
    (tmp_path / "theirs.safetensors").write_bytes(DEMO.read_bytes())
    for path in tmp_path.glob("theirs.*"):
        path.chmod(0)
    (tmp_path / "folder").mkdir(mode=0)

    def run(*argv: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-c", AS_OTHERS, *argv]
        return subprocess.run(command, check=False, cwd=tmp_path, capture_output=True, text=True)

    if not run("-c", "open('theirs.ply')").returncode:
        needs.lack("a system that can keep files from root")
    done = run("-m", "mplicits", *argv)
    (tmp_path / "folder").chmod(0o755)
    assert done.returncode == 2, done.stderr
    assert done.stderr == f"mplicits: {said}\n"
