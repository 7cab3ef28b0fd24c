"""Files of a drop, and of a dropped folder: scripts cannot drop folders, so the transfer is a stand-in."""

from typing import TYPE_CHECKING, Any

import pytest

from support.page_scripts import scope

if TYPE_CHECKING:
    from playwright.sync_api import Browser

LIST = """async (tree) => {
    // An entry of a tree {name: content, or a tree}; readers hand out two entries at a time, as browsers hand out 100.
    const entryOf = (fullPath, content) => typeof content === "string"
        ? {isFile: true, fullPath, file: (yes) => yes(new File([content], fullPath.split("/").at(-1)))}
        : {isDirectory: true, fullPath, createReader() {
            const entries = Object.entries(content).map(([name, inner]) => entryOf(`${fullPath}/${name}`, inner));
            return {readEntries: (yes) => setTimeout(() => yes(entries.splice(0, 2)))};
        }};
    const items = Object.entries(tree).map(([name, content]) => (
        {webkitGetAsEntry: () => entryOf(`/${name}`, content)}));
    items.push({webkitGetAsEntry: () => null});
    const found = await filesOfDrop({items, files: [new File(["1"], "plain")]});
    return Promise.all(found.map(async (file) => [file.path ?? null, file.name, await file.text()]));
}"""


@pytest.fixture(scope="module")
def listed(browser: "Browser") -> Any:
    with scope(browser, ("folder.js",), f"window.list = {LIST};") as page:
        yield lambda tree: page.evaluate("tree => window.list(tree)", tree)


def test_all_files_of_a_folder_are_listed_with_their_paths(listed: Any) -> None:
    tree = {
        "cow": {"cow.obj": "o", "cow.mtl": "m", "maps": {"a.png": "a", "b.png": "b", "c.png": "c"}},
        "more.txt": "t",
    }
    expected = {
        ("/cow/cow.obj", "cow.obj", "o"),
        ("/cow/cow.mtl", "cow.mtl", "m"),
        *((f"/cow/maps/{name}.png", f"{name}.png", name) for name in "abc"),
        ("/more.txt", "more.txt", "t"),
    }
    found = listed(tree)
    assert {tuple(file) for file in found} == expected
    assert len(found) == len(expected)


def test_files_without_folders_are_the_transfer_s(listed: Any) -> None:
    assert listed({"a.obj": "o"}) == [[None, "plain", "1"]]


def test_a_huge_folder_ends(listed: Any) -> None:
    assert len(listed({"many": {f"{i}.png": "" for i in range(1500)}})) == 1000
