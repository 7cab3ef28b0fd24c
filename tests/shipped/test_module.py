"""The module of a model on a web site: in the tag <mplicits-view>, and as an object of three.js."""

import base64
import io
import math
import shutil
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import pytest
from PIL import Image

from mplicits.codegen.targets.orbit import FOV
from support.conditions import CONDITIONS, Condition, check_line, conditioned
from support.likeness import check_alike
from support.module_pages import three_js
from support.references import DRAG, PIXELS, SHARE, SIZE, check_rendered, rendered
from support.server import served
from support.stranger import MODULE, Stranger
from support.tabs import Tab, chromium_tab, firefox_tab, framed, steady

if TYPE_CHECKING:
    from pathlib import Path

    from playwright.sync_api import Browser

pytestmark = pytest.mark.slow

VIEW = f"""<!doctype html><meta charset="utf-8"><title>A view</title>
<meta name="viewport" content="width=device-width"><link rel="icon" href="data:,">
<style>body {{ margin: 0 }} mplicits-view {{ display: block; width: 100vw; height: 100vh }}</style>
<script type="module" src="{MODULE}.js"></script>
<mplicits-view alt="A cow" camera-controls background="slate"></mplicits-view>"""
SCENE = f"""<!doctype html><meta charset="utf-8"><title>A scene</title><link rel="icon" href="data:,"><canvas></canvas>
<script src="three.min.js"></script><script type="module">
import {{createMesh}} from "./{MODULE}.js";
const canvas = document.querySelector("canvas"), context = canvas.getContext("webgl2", {{preserveDrawingBuffer: true}});
const renderer = new THREE.WebGLRenderer({{canvas, context}}), scene = new THREE.Scene();
renderer.setSize({PIXELS[0]}, {PIXELS[1]}, false);
renderer.setClearColor(0, 0);
scene.add(createMesh(THREE), new THREE.AmbientLight(0xffffff, 1));
const camera = new THREE.PerspectiveCamera({FOV}, {PIXELS[0] / PIXELS[1]}, 0.1, 20);
window.draw = (x, y, z) => {{
    camera.position.set(x, y, z);
    camera.lookAt(0, 0, 0);
    renderer.render(scene, camera);
    return canvas.toDataURL();
}};
</script>"""
ORBIT = "document.querySelector('mplicits-view').getCameraOrbit()"
"""The camera of the element: theta and phi in radians, radius in model units."""


@pytest.fixture
def site(shipped: Stranger, tmp_path: "Path") -> Iterator[str]:
    """The address of a site with the module, a page with the tag, and a page with a scene."""
    shutil.copy(shipped.folder / f"{MODULE}.js", tmp_path)
    (tmp_path / "view.html").write_text(VIEW, encoding="utf-8")
    (tmp_path / "scene.html").write_text(SCENE, encoding="utf-8")
    with served(tmp_path) as address:
        yield address


def hash_of(tab: Tab) -> str:
    """Return the element's camera as the hash of a page's address."""
    orbit = tab.evaluate(ORBIT)
    azimuth, polar = math.degrees(orbit["theta"]), math.degrees(orbit["phi"])
    return f"#az={azimuth:.4f}&el={90 - polar:.4f}&d={orbit['radius']:.5f}"


def check_view(tab: Tab, shipped: Stranger) -> None:
    """Compare the element with `mplicits render`, before and after a drag."""
    tab.until("document.querySelector('mplicits-view').modelIsVisible")
    for name in ("view", "view-turned"):
        check_rendered(steady(tab), shipped, MODULE, hash_of(tab), name)
        if name == "view":
            before = hash_of(tab)
            tab.drag(*DRAG)
            assert hash_of(tab) != before


def test_chromium(browser: "Browser", site: str, shipped: Stranger) -> None:
    with chromium_tab(browser, f"{site}view.html", SIZE, SHARE, offline=False) as tab:
        check_view(tab, shipped)
        assert tab.console() == []


def test_firefox(site: str, shipped: Stranger, tmp_path: "Path") -> None:
    (folder := tmp_path / "firefox").mkdir()
    with firefox_tab(folder, SIZE, SHARE) as tab:
        (tmp_path / "host.html").write_text(framed("view.html", SIZE), encoding="utf-8")
        tab.enter(f"{site}host.html")
        check_view(tab, shipped)
        assert tab.console() == []


@pytest.mark.parametrize("name", CONDITIONS)
def test_conditions(name: str, browser: "Browser", site: str, shipped: Stranger) -> None:
    condition = CONDITIONS[name] if name != "no-decompression" else Condition(script=CONDITIONS[name].script)
    with conditioned(browser, f"{site}view.html", condition, SIZE, SHARE) as tab:
        if condition.says:
            check_line(tab, condition.says)
            tab.drag(*DRAG)
        else:
            check_view(tab, shipped)


def test_three_js(browser: "Browser", site: str, shipped: Stranger, tmp_path: "Path") -> None:
    """In white light from everywhere, the object has the colors of the model."""
    shutil.copy(three_js(), tmp_path)
    azimuth, elevation, distance = 30, 20, 3.6
    x, y, z = (
        distance * math.cos(math.radians(elevation)) * math.sin(math.radians(azimuth)),
        distance * math.sin(math.radians(elevation)),
        distance * math.cos(math.radians(elevation)) * math.cos(math.radians(azimuth)),
    )
    with chromium_tab(browser, f"{site}scene.html", SIZE, SHARE, offline=False) as tab:
        tab.until("window.draw")
        data = base64.b64decode(tab.evaluate(f"draw({x}, {y}, {z})").partition(",")[2])
        assert tab.console() == []
    drawn = np.asarray(Image.open(io.BytesIO(data)).convert("RGBA"), np.int16)
    hash_ = f"#az={azimuth}&el={elevation}&d={distance}"
    reference = rendered(shipped, MODULE, hash_, shade="texture", more="--transparent --samples 1")
    assert (drawn[..., 3] > 127).mean() > 0.1
    assert ((drawn[..., 3] > 127) != (reference[..., 3] > 127)).mean() < 0.005
    both = (drawn[..., 3] > 254) & (reference[..., 3] > 254)
    check_alike(drawn[both][:, None, :3], "three", reference[both][:, None, :3])
