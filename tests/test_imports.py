"""House rules that the source code follows.

Imports run one way, an __init__ has a docstring only (in glsl also its loader), the page's modules make one
script, and no file is named as a drawer for anything.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from mplicits.web.bundle import modules
from mplicits.web.bundle import sources as scripts
from mplicits.web.module import ENTRIES
from support.paths import ROOT

UNITS: dict[str, set[str]] = {
    "glsl": set(),
    "model": set(),
    "readers": {"model"},
    "ir": {"model"},
    "field": {"model", "ir"},
    "codegen.printers": {"glsl", "model", "ir"},
    "codegen.targets": {"glsl", "model", "ir", "field", "codegen.printers"},
    "codegen": set(),
    "web": {"glsl", "model", "ir", "field", "codegen.printers", "codegen.targets", "trainer"},
    "bake": {"model", "ir", "field", "codegen.targets", "web"},
    "trainer.shapes": {"model", "readers"},
    "trainer.networks": {"model"},
    "trainer.folders": {"model"},
    "trainer": {"model", "readers", "trainer.shapes", "trainer.networks", "trainer.folders"},
    "capture": {"model", "trainer", "trainer.networks"},
    "scenes": {"model", "ir", "field"},
    "mesher": {"model", "readers", "ir", "field"},
    "reporting": {"model", "ir", "field", "codegen.targets", "web", "bake", "mesher"},
    "site": {"model", "web", "bake"},
    "viewer.draw": {"glsl", "model", "readers", "codegen.targets"},
    "viewer.state": {"glsl", "model", "codegen.targets", "bake", "viewer.draw"},
    "viewer.window": {"model", "codegen.targets", "bake", "viewer.draw", "viewer.state"},
    "viewer": {"model", "codegen.targets", "viewer.draw", "viewer.state", "viewer.window"},
    "api": {
        *("model", "ir", "field", "codegen.printers", "codegen.targets", "web", "bake", "mesher"),
        *("trainer", "trainer.networks", "trainer.shapes", "capture", "scenes", "viewer", "viewer.draw", "reporting"),
    },
    "": {"api", "model", "field", "codegen.targets", "mesher", "trainer", "capture", "scenes", "viewer"},
}
"""Folder, as a dotted name -> the other folders that its files may import from.

A folder does not include its subfolders. The files at the root, named "", are the front door.
"""
ROOMS = (
    *("glsl", "model", "readers", "ir", "field", "codegen", "web", "bake"),
    *("trainer", "capture", "scenes", "mesher", "reporting", "site", "viewer", "api"),
)
FRONT_DOOR = {path.stem for path in ROOT.glob("*.py")} - {"__init__", "__main__"}
"""Modules at the root: cli, demo."""


def unit_of(dotted: str) -> str:
    """The folder of UNITS that a dotted name lies in: 'codegen.targets' for 'codegen.targets.wgsl.standalone'."""
    parts = dotted.split(".")
    return next(name for k in range(len(parts), -1, -1) if (name := ".".join(parts[:k])) in UNITS)


def sources(unit: str) -> list[Path]:
    """Return the Python files of a folder of UNITS, without subfolders."""
    return sorted((ROOT / unit.replace(".", "/")).glob("*.py"))


def imports(source: str) -> Iterator[tuple[int, str]]:
    """Yield the leading dots and the dotted name of each import, in functions and by import_module("...") too."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from ((0, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((node.level, f"{node.module or ''}.{alias.name}".strip(".")) for alias in node.names)
        elif isinstance(node, ast.Call) and isinstance(node.func, (ast.Name, ast.Attribute)):
            called = node.func.id if isinstance(node.func, ast.Name) else node.func.attr
            first = node.args[0] if node.args else None
            if called in {"import_module", "__import__"} and isinstance(first, ast.Constant):
                name = str(first.value)
                yield len(name) - len(name.lstrip(".")), name.lstrip(".")


def violations(unit: str, source: str) -> list[str]:
    """Describe the wrong imports in the source of a file of the folder `unit`."""
    wrong = []
    folder = unit.split(".") if unit else []
    for dots, name in imports(source):
        top = name.partition(".")[0]
        if dots == 0:
            if top in {"mplicits", "tests", "benchmarks", *ROOMS, *FRONT_DOOR}:
                wrong.append(f"{name}: the package imports itself relatively, and neither tests nor benchmarks")
            elif top == "torch" and not unit.startswith(("trainer", "capture")):
                wrong.append("torch: only trainer and capture import it")
        elif dots > len(folder) + 1:
            wrong.append(f"{'.' * dots}{name}: leaves the package")
        else:
            target = unit_of(".".join([*folder[: len(folder) - dots + 1], name]))
            if target != unit and target not in UNITS[unit]:
                wrong.append(f"{'.' * dots}{name}: {unit or 'the front door'} must not import from {target or 'it'}")
    return wrong


@pytest.mark.parametrize("unit", UNITS)
def test_imports_run_one_way(unit: str) -> None:
    wrong_imports = [
        f"{path.relative_to(ROOT)}: {wrong}"
        for path in sources(unit)
        for wrong in violations(unit, path.read_text(encoding="utf-8"))
    ]
    assert not wrong_imports


def command_line_imports(source: str) -> list[str]:
    """Return the imports of modules that only declare the command line: cli.py, *_cli.py, arguments.py."""
    return [name for dots, name in imports(source) if dots and re.search(r"(^|\.)(\w+_)?(cli|arguments)(\.|$)", name)]


def test_libraries_do_not_import_the_command_line() -> None:
    for path in (path for unit in UNITS for path in sources(unit)):
        if not re.fullmatch(r"(\w+_)?(cli|arguments)|__main__", path.stem):
            assert not command_line_imports(path.read_text(encoding="utf-8")), path


@pytest.mark.parametrize(
    ("unit", "source"),
    [
        ("codegen", "import mplicits.viewer.draw.camera"),
        ("codegen", "from .printers.cstyle import Language"),
        ("codegen", "import importlib\nimportlib.import_module('..trainer.cli', __package__)"),
        ("ir", "def f():\n    from ..trainer.train import fit"),
        ("viewer", "import torch"),
        ("glsl", "from ...codegen import cli"),
        ("", "from .glsl import load"),
    ],
)
def test_a_wrong_import_is_found(unit: str, source: str) -> None:
    assert len(violations(unit, source)) == 1


def test_every_folder_with_code_is_known() -> None:
    folders = {path.parent for room in ROOMS for path in (ROOT / room).rglob("*.py")}
    assert {str(path.relative_to(ROOT)).replace("/", ".") for path in folders} == set(UNITS) - {""}


def test_only_its_own_tests_import_a_benchmark_and_the_tests_import_no_test() -> None:
    benchmarks = {path.stem for path in (ROOT / "benchmarks").glob("*.py")}
    for path in (ROOT / "tests").rglob("*.py"):
        tops = {name.partition(".")[0] for dots, name in imports(path.read_text(encoding="utf-8")) if not dots}
        own = path.stem.removeprefix("test_")
        foreign = {top for top in tops if top in benchmarks and top.partition("_")[0] != own}
        assert not foreign | {top for top in tops if top.startswith("test_")}, path


@pytest.mark.parametrize("room", ROOMS)
def test_an_init_holds_a_docstring_and_nothing_else(room: str) -> None:
    for path in (ROOT / room).rglob("__init__.py"):
        body = ast.parse(path.read_text(encoding="utf-8")).body
        assert isinstance(body[0], ast.Expr), path
        assert isinstance(body[0].value, ast.Constant), path
        public = [node.name for node in body if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")]
        assert (public == ["read", "load", "load_numbered"]) if room == "glsl" else (len(body) == 1), path


def declared(source: str) -> Iterator[str]:
    """The names that a JavaScript module declares outside of functions, each in its declaration's first line."""
    yield from re.findall(r"^(?:export )?(?:async )?(?:function|class) (\w+)", source, re.MULTILINE)
    for text in re.findall(r"^(?:export )?(?:const|let) (.*)", source, re.MULTILINE):
        for pattern in re.findall(r"(?:^|, )([\[{][^=]*[\]}]) = ", text):
            yield from re.findall(r"\b\w+\b(?!:)", pattern)
        names = re.sub(r'"[^"]*"', "", text)
        while names != (names := re.sub(r"\([^()]*\)|\[[^\[\]]*\]|\{[^{}]*\}", "", names)):
            pass
        yield from re.findall(r"(?:^|, )(\w+)(?= =|;|,|$)", re.sub(r"[(\[{].*", "", names))


def script_violations(sources: dict[str, str]) -> list[str]:
    """Say what keeps JavaScript modules, name -> source, from being joined into one script in this order."""
    wrong, exported, owner = [], dict[str, set[str]](), dict[str, str]()
    for module, source in sources.items():
        imported = re.findall(r'^import \{([^}]*)\} from "\.[./]*/(?:\w+/)?(\w+\.js)";$', source, re.MULTILINE)
        if len(imported) != len(re.findall("^import", source, re.MULTILINE)):
            wrong.append(f'{module}: an import that is not {{names}} from "./module.js" or "../folder/module.js"')
        for names, path in imported:
            missing = set(re.findall(r"\w+", names)) - exported.get(path, set())
            wrong += [f"{module}: {name} is no export of {path}, or {path} comes later" for name in sorted(missing)]
        lines = [line for line in source.splitlines() if line.startswith("export ")]
        exported[module] = set(declared("\n".join(lines)))
        for name in declared(source):
            if name in owner:
                wrong.append(f"{module}: {name} is {owner[name]}'s")
            owner.setdefault(name, module)
    return wrong


@pytest.mark.parametrize("entries", [("page.js",), ("worker.js",), ("studio.js", "page.js"), ENTRIES])
def test_modules_of_a_page_make_one_script(entries: tuple[str, ...]) -> None:
    assert not script_violations({name: scripts()[name] for name in modules(*entries)})


def test_every_module_is_in_a_page() -> None:
    used = modules("page.js", "worker.js", "studio.js", *ENTRIES)
    alone = {"draw.js", "unpack.js", "before_paint.js", "unpacker.js"}  # scripts without imports
    assert set(scripts()) == {*used} | alone


FOLDERS = {
    "model": set(),
    "print": {"model"},
    "draw": {"model", "print"},
    "view": {"model", "print", "draw"},
    "element": {"model", "print", "draw", "view"},
    "read": {"model"},
    "kernel": set(),
    "shape": {"model", "read", "kernel"},
    "train": {"model", "kernel", "shape", "view"},
    "save": {"model", "print", "draw", "view", "read", "kernel", "shape", "train"},
    "stage": {"model", "print", "draw", "view", "read", "kernel", "shape", "train", "save"},
    "tiny": set(),
}
"""Folder of scripts in web/ -> the folders that its modules may import from."""


@pytest.mark.parametrize("folder", FOLDERS)
def test_scripts_import_one_way(folder: str) -> None:
    for path in (ROOT / "web" / folder).glob("*.js"):
        for names, place in re.findall(r'^import \{([^}]*)\} from "(.*)";$', path.read_text("utf-8"), re.MULTILINE):
            found = (path.parent / place).resolve()
            assert found.is_file(), f"{path.name}: {place}"
            assert found.parent.name in {folder, *FOLDERS[folder]}, f"{path.name}: {names} of {place}"


def test_every_folder_of_scripts_is_known() -> None:
    assert {path.parent.name for path in (ROOT / "web").glob("*/*.js")} == set(FOLDERS)


@pytest.mark.parametrize(
    "source",
    [
        'import {fourth} from "./c.js";',
        'import {second} from "./a.js";',
        "const third = 1, first = 2;",
        "const {third, first} = second;",
        "const third = (fourth) => fourth, {third: first} = second;",
        "export async function first() {\n}",
    ],
)
def test_a_wrong_module_is_found(source: str) -> None:
    before, after = "export const first = 1;\nconst second = first;\n", "export const fourth = 1;\n"
    assert not script_violations({"a.js": before, "b.js": 'import {first} from "./a.js";', "c.js": after})
    assert len(script_violations({"a.js": before, "b.js": source, "c.js": after})) == 1


def test_no_file_is_a_drawer() -> None:
    code = [path for folder in (*ROOMS, "benchmarks", "tests") for path in (ROOT / folder).rglob("*.*")]
    assert not [path for path in code if path.stem in {"utils", "util", "helpers", "misc", "common"}]
