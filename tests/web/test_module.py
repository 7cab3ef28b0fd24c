"""The module of a model: its text, and its element <mplicits-view> in browsers."""

import gzip
import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image

import mplicits
from mplicits.codegen.targets.header import read_header
from mplicits.model.errors import UserError
from mplicits.model.model_file import to_bytes
from mplicits.web.minified import short_names
from mplicits.web.module import baked
from mplicits.web.weights import MOST_ERROR, coded_weights
from support import needs
from support.browser import PATIENCE, listen
from support.fitted_model import fitted_model
from support.module_pages import WATCH, module_page
from support.packed_model import packed_model
from support.page_pictures import MODEL
from support.random_model import random_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Route

FIELD = mplicits.Field(fitted_model((8, 16)))
BODY = """<style>mplicits-view { width: 96px; height: 96px; }</style>
<mplicits-view id="first" alt="A ball" camera-controls shade="phong" camera-orbit="90deg 60deg 200%"></mplicits-view>
<mplicits-view id="second" background="ffffff" level="1" reveal="manual"><b slot="poster">Poster</b></mplicits-view>
<mplicits-view id="missing" model="nobody" loading="eager"></mplicits-view>
<div style="height: 3000px"></div>
<mplicits-view id="third" turntable="10" shade="normal"></mplicits-view>"""


@contextmanager
def opened(browser: "Browser", folder: Path, body: str = BODY, **options: Any) -> Iterator["Page"]:
    """Open a page with the module and `body`; the page is at the top. options: of Playwright's new_context."""
    path = folder / "page.html"
    path.write_text(module_page(FIELD, body, WATCH), encoding="utf-8")
    context = browser.new_context(offline=True, viewport={"width": 400, "height": 400}, **options)
    context.set_default_timeout(PATIENCE)
    page, errors = context.new_page(), list[str]()
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(path.as_uri())
    page.wait_for_function("() => window.log")
    yield page
    context.close()
    assert errors == []


def told(page: "Page", view: str, kind: str) -> None:
    """Wait for an event of an element."""
    page.wait_for_function(f"() => log.some(([view, type]) => view === '{view}' && type === '{kind}')")


def visit_page(page: "Page") -> None:
    """Use the elements of BODY as a visitor does."""
    told(page, "first", "load")
    told(page, "first", "poster-dismissed")
    told(page, "missing", "error")
    # A poster of the page's stays until it is dismissed, without a context.
    assert page.evaluate("() => [of('second').modelIsVisible, canvases('second'), canvases('third')]") == [False, 0, 0]
    page.evaluate("() => of('second').dismissPoster()")
    told(page, "second", "poster-dismissed")
    orbit = page.evaluate("() => of('first').getCameraOrbit()")
    np.testing.assert_allclose([orbit["theta"], orbit["phi"]], np.radians([90, 60]), atol=1e-6)
    assert page.evaluate("() => of('first').shadowRoot.querySelector('canvas').getAttribute('aria-label')").startswith(
        "A ball: "
    )
    page.evaluate("() => of('first').shadowRoot.querySelector('canvas').focus()")
    page.keyboard.press("ArrowLeft")
    assert page.evaluate("() => of('first').getCameraOrbit().theta") != orbit["theta"]
    last = page.evaluate("() => log.findLast(([id]) => id === 'first')")
    assert last == ["first", "camera-change", "user-interaction"]
    # Out of view, an element frees its context and keeps its picture; back in view, it draws again.
    page.evaluate("() => of('third').scrollIntoView()")
    told(page, "third", "poster-dismissed")
    page.wait_for_function("() => !canvases('first') && !of('first').shadowRoot.querySelector('.still').hidden")
    theta = page.evaluate("() => of('third').getCameraOrbit().theta")
    page.wait_for_function("theta => Math.abs(of('third').getCameraOrbit().theta - theta) > 0.05", arg=theta)
    page.evaluate("() => scrollTo(0, 0)")
    page.wait_for_function("() => canvases('first') && of('first').shadowRoot.querySelector('.still').hidden")


@pytest.mark.slow
def test_elements_in_chromium(browser: "Browser", tmp_path: Path) -> None:
    with opened(browser, tmp_path) as page:
        visit_page(page)
        size = page.evaluate("async () => (await of('first').toBlob()).size")
        assert size > 500


@pytest.mark.slow
def test_the_earlier_name_of_softbox_works_with_a_warning(browser: "Browser", tmp_path: Path) -> None:
    body = BODY.split("<mplicits", maxsplit=1)[0] + '<mplicits-view id="first"></mplicits-view>'
    with opened(browser, tmp_path, body) as page:
        lines = list[str]()
        page.on("console", lambda message: lines.append(message.text))
        told(page, "first", "load")
        shots = []
        for shade in ("softbox", "studio", "phong"):
            png = page.evaluate(
                """async (shade) => {
                    of("first").shade = shade;
                    return [...new Uint8Array(await (await of("first").toBlob()).arrayBuffer())];
                }""",
                shade,
            )
            shots.append(np.asarray(Image.open(io.BytesIO(bytes(png))).convert("RGB"), np.float64))
    softbox, studio, phong = shots
    assert np.abs(softbox - studio).mean() < 0.5, "grids of cells that come meanwhile move rays a little"
    assert np.abs(softbox - phong).mean() > 5
    assert [line for line in lines if line.startswith("mplicits")] == [
        'mplicits-view: shade="studio" is now shade="softbox"'
    ]


@pytest.mark.slow
def test_nothing_moves_by_itself_for_visitors_who_want_less_motion(browser: "Browser", tmp_path: Path) -> None:
    body = """<style>mplicits-view { width: 48px; height: 48px; }</style>
<mplicits-view id="first" turntable="2" shade="phong"></mplicits-view>"""
    orbits = []
    for choice in ("reduce", "no-preference"):
        with opened(browser, tmp_path, body, reduced_motion=choice) as page:
            told(page, "first", "load")
            orbits += page.evaluate("""async () => {
                const theta = () => of("first").getCameraOrbit().theta, before = theta();
                for (let i = 0; i < 20; ++i) await new Promise(requestAnimationFrame);
                return [theta() - before];
            }""")
    assert orbits[0] == 0
    assert orbits[1] != 0


def test_the_text_names_the_model_and_holds_it() -> None:
    text = baked(random_model((4, 0), name="</script><b>\u2028"), poster=False).text
    facts = read_header(text)
    assert (facts["name"], facts["target"]) == ("</script><b>\u2028", "module")
    assert "<b>" not in text.split("\n", 1)[1]
    assert "getElementById" not in text
    assert text.rstrip().endswith("export {MplicitsView, createMesh, loadModel, ownModel};")


def test_names_of_shaders_are_short_and_those_that_scripts_read_stay() -> None:
    text = '#include "width.glsl"\nuniform float level;\nfloat doubled(vec4 rgb) {\nreturn width*level*rgb.x;\n}\n'
    shaders = {"doubled.glsl": text, "width.glsl": "float width=2.0;\n"}
    assert short_names(shaders, "names.level = ab(doubled.glsl)") == {
        "doubled.glsl": '#include "width.glsl"\nuniform float level;float doubled(vec4 rgb) {return aa*level*rgb.x;}\n',
        "width.glsl": "float aa=2.0;\n",
    }


@pytest.mark.slow
@pytest.mark.parametrize(("name", "most"), [("spot-small", 45_000), ("spot", 60_500)])
def test_modules_of_the_gallery_are_light(name: str, most: int) -> None:
    needs.package("minify")
    text = baked(mplicits.load(name).model).text
    assert len(gzip.compress(text.encode(), 9)) <= most


def test_weights_are_packed_within_the_error(tmp_path: Path) -> None:
    coded = coded_weights(MODEL)
    assert coded is not None
    assert len(coded.data) < 0.7 * len(to_bytes(MODEL))
    assert 0 < coded.error[0] <= MOST_ERROR
    path = tmp_path / "packed.safetensors"
    path.write_bytes(coded.data)
    points = np.random.default_rng(0).uniform(-0.6, 0.6, (1000, 3)).astype(np.float32)
    exact, rounded = mplicits.Field(MODEL), mplicits.load(path)
    near = np.abs(exact(points)) < 0.05
    assert np.abs(exact(points) - rounded(points))[near].max() < 1.5 * MOST_ERROR
    assert coded_weights(rounded.model) is None, "a packed model stays as it is"


def test_bake_writes_types_beside_the_module(tmp_path: Path) -> None:
    path = tmp_path / "ball.js"
    FIELD.bake("module", path)
    types = (tmp_path / "ball.d.ts").read_text(encoding="utf-8")
    assert read_header(types)["target"] == "module"
    for name in ("MplicitsView", "createMesh", "loadModel", "ownModel"):
        assert f" {name}" in types
    (tmp_path / "ball.d.ts").write_text("mine")
    with pytest.raises(UserError, match=r"ball\.d\.ts: it exists"):
        FIELD.bake("module", path)


@pytest.mark.slow
def test_two_modules_and_a_file_share_a_page(browser: "Browser", tmp_path: Path) -> None:
    other = mplicits.Field(random_model((8, 0), name="other"))
    body = f"""<style>mplicits-view {{ width: 96px; height: 96px; }}</style>
<script type="module" src="a.js"></script><script type="module" src="b.js"></script>
<mplicits-view id="first"></mplicits-view><mplicits-view id="second" model="other"></mplicits-view>
<mplicits-view id="third" src="ball.safetensors"></mplicits-view><mplicits-view id="packed" src="packed.safetensors">
</mplicits-view><mplicits-view id="damaged" src="a.js"></mplicits-view><script>{WATCH}</script>"""
    FIELD.bake("module", tmp_path / "a.js")
    other.bake("module", tmp_path / "b.js")
    FIELD.save(tmp_path / "ball.safetensors")
    mplicits.Field(packed_model(FIELD.model)).save(tmp_path / "packed.safetensors")
    assert b'"packed":{"dtype":"U8"' in (tmp_path / "packed.safetensors").read_bytes()
    (tmp_path / "page.html").write_text(f"<!doctype html>{body}")
    context = browser.new_context(viewport={"width": 700, "height": 900})
    context.set_default_timeout(PATIENCE)
    page, lines = context.new_page(), list[str]()
    listen(page, lines)

    def serve(route: "Route") -> None:
        name = route.request.url.rpartition("/")[2]
        if name == "b.js":
            late.append(route)
        else:
            route.fulfill(path=tmp_path / name)

    late = list["Route"]()
    page.route("http://page.test/*", serve)
    page.goto("http://page.test/page.html", wait_until="commit")
    page.wait_for_function("() => window.log")
    told(page, "first", "load")
    # The second element has waited for the module that has its model.
    late[0].fulfill(path=tmp_path / "b.js")
    for view in ("first", "second", "third", "packed"):
        told(page, view, "poster-dismissed")
    told(page, "damaged", "error")
    names = [page.get_by_role("img", name=name).count() for name in ("fitted", "other")]
    context.close()
    assert names == [3, 1]
    assert lines == ["mplicits-view: a.js cannot be loaded: not a model file (.safetensors), or a damaged one"]
