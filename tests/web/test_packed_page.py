"""Packed pages: the same page, with nothing lost but comments, under the same policy."""

import base64
import hashlib
import json
import re
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from pygments.lexers import JavascriptLexer
from pygments.token import Comment

from mplicits.bake.registry import TARGETS
from mplicits.cli import main
from mplicits.model.gallery import model_path
from mplicits.model.model_file import load, save
from mplicits.model.quantize import quantized_model
from mplicits.web import page, studio_page
from mplicits.web.bundle import modules, script, sources
from mplicits.web.document import Studio, packed
from mplicits.web.minified import minified, short_script
from mplicits.web.weights import MOST_ERROR, short_weights
from support import needs
from support.browser import PATIENCE, visit
from support.firefox import firefox
from support.page_pictures import MODEL
from support.unpacked import tiny_script, unpacked

if TYPE_CHECKING:
    from playwright.sync_api import Browser

STATE = "document.documentElement.dataset"
PROBE = """
const seen = {};
const wait = (make) => new Promise(make).catch(() => "refused");
seen.fetch = await fetch("/data").then(() => "sent", () => "refused");
for (const name of ["img", "script", "iframe"]) {
    seen[name] = await wait((resolve) => {
        const one = document.createElement(name);
        Object.assign(one, {onload: () => resolve("sent"), onerror: () => resolve("refused"), src: `/${name}`});
        document.body.append(one);
    });
}
seen.worker = await wait((resolve) => {
    const text = `fetch("${location.origin}/worker").then(() => postMessage("sent"), () => postMessage("refused"))`;
    const worker = new Worker(URL.createObjectURL(new Blob([text])));
    worker.onmessage = ({data}) => resolve(data);
});
for (const [name, run] of [["eval", () => eval("'ran'")], ["function", () => new Function("return 'ran'")()]]) {
    try {
        seen[name] = run();
    } catch {
        seen[name] = "refused";
    }
}
const more = document.createElement("script");
more.textContent = "globalThis.inline = 'ran'";
document.body.append(more);
seen.inline = globalThis.inline ?? "refused";
seen.kernel = await WebAssembly.compile(new Uint8Array([0, 97, 115, 109, 1, 0, 0, 0])).then(() => "allowed", String);
document.documentElement.dataset.seen = JSON.stringify(seen);
"""
"""A script that asks for the network in several ways, and for other scripts, after the page is unpacked."""


def tokens(script: str) -> list[str]:
    """Return the tokens of JavaScript, without comments and white space, and with lines of literals unindented."""
    kept = [text for kind, text in JavascriptLexer().get_tokens(script) if kind not in Comment]
    return [re.sub(r"\s+", " ", text) for text in kept if text.strip()]


@pytest.mark.parametrize("entry", ["page.js", "studio.js", "worker.js"])
def test_scripts_lose_only_comments(entry: str) -> None:
    text = script(modules(entry))
    assert tokens(short_script(text)) == tokens(text)
    assert not {"import", "export"} & set(tokens(text))
    assert len(short_script(text)) < 0.9 * len(text)


def test_comments_in_strings_stay() -> None:
    comments = "// a comment\n    // a line\n    /** @type {string}\n */\n"
    text = f'const a = "x // /** y */"; {comments}    const b = `${{a}} // ${{a}}`;\n'
    assert short_script(text) == 'const a = "x // /** y */";\nconst b = `${a} // ${a}`;\n'


PATTERNS = """
const twice = (x) => [x, x];
globalThis.results = [1, 2].map((x) => {
    const one = twice(x), two = one.length, text = "a, [b]; {c"; // [d], {e}
    const [a, b] = (two ? one : text).map((y) => y + 1);
    let c = {value: a}, {value} = Object.assign({}, {value: c.value + two});
    const [d] = `${[c.value, b]};`, f = d + value;
    if (f) { const {length} = (text); globalThis.length_ = length; }
    return [one, two, text, a, b, c, value, d, f];
});
"""
"""Declarations that tdewolff-minify 2.24 alone puts into a wrong order."""


def test_a_minified_script_does_the_same(browser: "Browser") -> None:
    needs.package("minify")
    tab = browser.new_page()
    results = []
    for text in (PATTERNS, minified(PATTERNS)):
        tab.evaluate(f"() => {{ {text} }}")
        results.append(tab.evaluate("JSON.stringify([results, length_])"))
    tab.close()
    assert results[0] == results[1]
    assert len(minified(PATTERNS)) < 0.8 * len(short_script(PATTERNS))


def test_the_packed_page_holds_the_page() -> None:
    made, _ = page.page_of(MODEL)
    small = packed(made).text
    inner = unpacked(small)
    held = {name: re.search(rf'id="{name}">(.*?)</script>', inner, re.DOTALL) for name in ("weights", "facts")}
    assert held["weights"] is not None
    assert held["facts"] is not None
    assert base64.b64decode(held["weights"][1]) == made.data
    assert json.loads(held["facts"][1]).items() >= made.facts.items()
    assert re.findall(r'<img id="poster"[^>]*>', small) == re.findall(r'<img id="poster"[^>]*>', inner)
    assert inner.count("<script") == len(made.shaders) + 4  # before the first paint, facts, weights, and the page's
    assert "<title>fitted</title>" in small


@pytest.mark.parametrize(
    ("script", "more", "line"),
    [
        ("delete globalThis.DecompressionStream", "", "This browser is too old for this page."),
        ("", "abc", "This file is damaged;"),
    ],
)
def test_one_line_says_why_a_page_does_not_unpack(
    browser: "Browser", tmp_path: Path, script: str, more: str, line: str
) -> None:
    file = tmp_path / "packed.html"
    text = packed(page.empty_page("empty")).text
    file.write_text(text.replace('id="packed">', f'id="packed">{more}'), encoding="utf-8")
    with visit(browser, file, script=script) as visited:
        visited.until(f"document.getElementById('note').textContent.startsWith({line!r})")
        assert visited.console == []


class Asked(SimpleHTTPRequestHandler):
    """Keeps the paths of all requests."""

    paths: list[str]

    def __init__(self, paths: list[str], *arguments: Any, **options: Any) -> None:
        self.paths = paths
        super().__init__(*arguments, **options)

    def log_message(self, format: str, *arguments: Any) -> None:
        self.paths.append(self.path)


@pytest.fixture
def hosted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[str, list[str]]]:
    """The address of a page that asks for the network, and the paths of requests."""
    found = sources() | {"probe.js": PROBE}
    monkeypatch.setattr("mplicits.web.bundle.sources", lambda: found)
    studio = Studio(modules=("probe.js",), policy=studio_page.parts().policy)
    (tmp_path / "probe.html").write_text(packed(page.empty_page("probe", studio=studio)).text, encoding="utf-8")
    paths: list[str] = []
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Asked, paths, directory=str(tmp_path)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/probe.html", paths
    server.shutdown()
    server.server_close()


ASKED = ("fetch", "img", "script", "worker", "eval", "function", "inline")
REFUSED = {**dict.fromkeys(ASKED, "refused"), "kernel": "allowed"}


@pytest.mark.parametrize("target", ["html", "tiny"])
def test_bake_prints_the_policy_which_names_all_scripts_by_their_hashes(
    target: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, file = tmp_path / "m.safetensors", tmp_path / "m.html"
    save(MODEL, source)
    assert main(["bake", str(source), "--target", target, "-o", str(file)]) == 0
    text = file.read_text("utf-8")
    (policy,) = re.findall(r'http-equiv="?Content-Security-Policy"? content="([^"]*)"', text)
    assert f"header: {policy}\n" in capsys.readouterr().err
    inside = unpacked(text) if target == "html" else f"<script>{tiny_script(text)}</script>"
    scripts = re.findall(r'<script(?: type="module")?>(.*?)</script>', text + inside, re.DOTALL)
    assert len(scripts) == {"html": 3, "tiny": 2}[target]
    digests = [base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in scripts]
    (sources,) = re.findall(r"script-src ([^;]*)", policy)
    assert sources == " ".join(f"'sha256-{digest}'" for digest in digests)


def test_the_policy_holds_after_unpacking(browser: "Browser", hosted: tuple[str, list[str]]) -> None:
    address, paths = hosted
    tab = browser.new_page()
    tab.set_default_timeout(PATIENCE)
    tab.goto(address)
    tab.wait_for_function(f"() => {STATE}.seen")
    seen = json.loads(tab.evaluate(f"{STATE}.seen"))
    tab.close()
    assert {key: seen[key] for key in REFUSED} == REFUSED
    assert paths == ["/probe.html"]


@pytest.mark.slow
def test_the_policy_holds_in_firefox(xvfb: dict[str, str], hosted: tuple[str, list[str]], tmp_path: Path) -> None:
    address, paths = hosted
    (tmp_path / "profile").mkdir()
    with firefox(tmp_path / "profile", xvfb) as tab:
        tab.load(address)
        tab.until(f"'seen' in {STATE}")
        seen = json.loads(tab.evaluate(f"{STATE}.seen"))
    assert {key: seen[key] for key in REFUSED} == REFUSED
    assert paths == ["/probe.html"]


@pytest.mark.slow
@pytest.mark.usefixtures("zopfli")
@pytest.mark.parametrize(("name", "most"), [("spot-small", 65_000), ("spot", 110_000)])
def test_pages_of_the_gallery_are_light(name: str, most: int) -> None:
    needs.package("minify")
    text = TARGETS["html"](load(model_path(name)))
    assert len(text.encode()) <= most
    assert text.startswith('<!doctype html>\n<html lang="en">\n<!-- A page of mplicits, packed. Its readable source')


def test_short_weights_keep_quantized_ones_exactly() -> None:
    exact = short_weights(quantized_model(MODEL))
    assert exact is not None
    for name, tensor in quantized_model(MODEL).tensors().items():
        if name.endswith("weight"):
            assert np.array_equal(exact.model.tensors()[name], tensor), name
    assert exact.error[0] < 2e-6
    rounded = short_weights(MODEL)
    assert rounded is None or 0 < rounded.error[0] <= MOST_ERROR


@pytest.mark.slow
@pytest.mark.usefixtures("zopfli")
def test_the_studio_is_small() -> None:
    assert len(studio_page.studio().encode()) <= 150_000
