"""The house rules, checked on the source: which room and which of the page's modules may import which, what an __init__
holds, how long a file is.
"""

import ast
import itertools
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from codegen.webpage import SCRIPTS

ROOT = Path(__file__).parent.parent
MAY_IMPORT = {
    "glsl": set[str](),
    "models": set[str](),
    "codegen": {"glsl"},
    "trainer": {"glsl", "codegen"},
    "mesher": {"glsl", "codegen"},
    "viewer": {"glsl", "codegen"},
    "mplicits": {"glsl", "codegen", "trainer", "mesher", "viewer"},
}
OF_THE_HOUSE = {*MAY_IMPORT, "tests", "benchmarks"}
LONGEST = 250


def sources(room: str) -> list[Path]:
    """The Python files of a room, or the one of the front door."""
    return [ROOT / "mplicits.py"] if room == "mplicits" else sorted((ROOT / room).rglob("*.py"))


def imports(source: str) -> Iterator[tuple[int, str]]:
    """(dots, module) of each import, those inside functions and importlib.import_module("...") included."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from ((0, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.level, node.module or ""
        elif isinstance(node, ast.Call) and isinstance(node.func, (ast.Name, ast.Attribute)):
            called = node.func.id if isinstance(node.func, ast.Name) else node.func.attr
            first = node.args[0] if node.args else None
            if called in {"import_module", "__import__"} and isinstance(first, ast.Constant):
                yield 0, str(first.value)


def violations(room: str, source: str) -> list[str]:
    """What is wrong with the imports of a file of `room` that holds `source`."""
    wrong = []
    for dots, module in imports(source):
        top = module.partition(".")[0]
        if dots > 1:
            wrong.append(f"{'.' * dots}{module}: leaves the room; import it absolutely")
        elif dots == 0 and top == room and room != "mplicits":
            wrong.append(f"{module}: relative inside a room")
        elif dots == 0 and top in OF_THE_HOUSE - MAY_IMPORT[room] - {room}:
            wrong.append(f"{module}: {room} must not import it")
        elif dots == 0 and top == "torch" and room != "trainer":
            wrong.append("torch: only trainer imports it")
    return wrong


@pytest.mark.parametrize("room", MAY_IMPORT)
def test_imports_run_one_way(room: str) -> None:
    found = [f"{path.relative_to(ROOT)}: {wrong}" for path in sources(room)
             for wrong in violations(room, path.read_text(encoding="utf-8"))]
    assert not found


@pytest.mark.parametrize(("room", "source"), [
    ("codegen", "from viewer import camera"),
    ("codegen", "import viewer.camera"),
    ("codegen", "def f():\n    from trainer.train import fit"),
    ("codegen", "import importlib\nimportlib.import_module('trainer.cli')"),
    ("viewer", "from trainer.shape import Shape"),
    ("viewer", "import mplicits"),
    ("viewer", "import torch"),
    ("viewer", "from viewer.camera import Camera"),
    ("viewer", "from ..codegen import model"),
    ("trainer", "import benchmarks.train_step"),
    ("glsl", "from codegen.errors import UserError"),
    ("mplicits", "import torch.nn"),
])
def test_a_wrong_import_is_found(room: str, source: str) -> None:
    assert len(violations(room, source)) == 1


def test_nothing_imports_the_benchmarks_and_the_tests_import_no_test() -> None:
    for path in (ROOT / "tests").rglob("*.py"):
        tops = {module.partition(".")[0] for _, module in imports(path.read_text(encoding="utf-8"))}
        assert not {top for top in tops if top == "benchmarks" or top.startswith("test_")}, path


@pytest.mark.parametrize("room", [room for room in MAY_IMPORT if room != "mplicits"])
def test_an_init_holds_a_docstring_and_nothing_else(room: str) -> None:
    for path in (ROOT / room).rglob("__init__.py"):
        body = ast.parse(path.read_text(encoding="utf-8")).body
        assert isinstance(body[0], ast.Expr), path
        assert isinstance(body[0].value, ast.Constant), path
        public = [node.name for node in body if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")]
        assert (public == ["read", "load", "load_numbered"]) if room == "glsl" else (len(body) == 1), path


def declared(source: str) -> Iterator[str]:
    """Names that a JavaScript module declares outside of functions; the first line of a declaration holds its names."""
    yield from re.findall(r"^(?:export )?(?:async )?(?:function|class) (\w+)", source, re.MULTILINE)
    for text in re.findall(r"^(?:export )?(?:const|let) (.*)", source, re.MULTILINE):
        taken_apart = re.match(r"\{(.*?)\}", text)
        yield from re.findall(r"\w+", taken_apart[1]) if taken_apart else re.findall(r"(\w+) = ", text)


def script_violations(modules: dict[str, str]) -> list[str]:
    """What keeps JavaScript modules, name -> source, from being one script in this order."""
    wrong, exported, owner = [], dict[str, set[str]](), dict[str, str]()
    for module, source in modules.items():
        imported = re.findall(r'^import \{([^}]*)\} from "\./([\w.]+)";$', source, re.MULTILINE)
        if len(imported) != len(re.findall("^import", source, re.MULTILINE)):
            wrong.append(f'{module}: an import that is not {{names}} from "./module"')
        for names, path in imported:
            missing = set(re.findall(r"\w+", names)) - exported.get(path, set())
            wrong += [f"{module}: {name} is no export of {path}, or {path} comes later" for name in sorted(missing)]
        lines = [line for line in source.splitlines() if line.startswith("export ")]
        exported[module] = set(declared("\n".join(lines)))
        for name in declared(source):
            if owner.setdefault(name, module) != module:
                wrong.append(f"{module}: {name} is {owner[name]}'s")
    return wrong


def test_the_page_s_modules_make_one_script() -> None:
    folder = ROOT / "codegen" / "web"
    assert sorted(SCRIPTS) == sorted(path.name for path in folder.glob("*.js"))
    assert not script_violations({name: (folder / name).read_text(encoding="utf-8") for name in SCRIPTS})


@pytest.mark.parametrize("source", [
    'import "./a.js";', 'import {fourth} from "./c.js";', 'import {second} from "./a.js";',
    "const third = 1, first = 2;", "let first = 3;", "const {third, first} = second;", "class first {\n}",
    "function first() {\n}", "export async function first() {\n}",
])
def test_a_wrong_module_is_found(source: str) -> None:
    before, after = "export const first = 1;\nconst second = first;\n", "export const fourth = 1;\n"
    assert not script_violations({"a.js": before, "b.js": 'import {first} from "./a.js";', "c.js": after})
    assert len(script_violations({"a.js": before, "b.js": source, "c.js": after})) == 1


def test_files_are_short_and_have_a_purpose() -> None:
    folders = [*(room for room in MAY_IMPORT if room != "mplicits"), "benchmarks", "tests"]
    found = itertools.chain([ROOT / "mplicits.py"], *((ROOT / folder).rglob("*.*") for folder in folders))
    shaders = (ROOT / "glsl").glob("*.glsl")
    code = [*(path for path in found if path.suffix in {".py", ".js"}), *shaders]
    assert len(code) > 20
    assert not [path for path in code if path.stem in {"utils", "util", "helpers", "misc", "common"}]
    lines = {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8").count("\n") for path in code}
    assert not {name: count for name, count in lines.items() if count > LONGEST}
