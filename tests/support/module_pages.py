"""Pages with the module of a model (target module) inside, so that they run from file://, and scenes of three.js."""

import base64
import io
import json
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import mplicits
from mplicits.web.module import EXPORTS, baked
from support import needs

if TYPE_CHECKING:
    from playwright.sync_api import Page

FOV = 40.0
"""Vertical field of view, degrees."""
SCENE = """
const canvas = document.querySelector("canvas"), scene = new THREE.Scene(), {size, fov} = setup;
canvas.width = canvas.height = size;
const context = canvas.getContext("webgl2", {preserveDrawingBuffer: true, antialias: false});
const renderer = new THREE.WebGLRenderer({canvas, context});
renderer.setClearColor(0x405468);
renderer.shadowMap.enabled = true;
const sun = new THREE.DirectionalLight(0xffffff, 0.75);
sun.position.set(2, 5, 3);
sun.castShadow = true;
sun.shadow.bias = -0.004;
sun.shadow.mapSize.set(1024, 1024);
Object.assign(sun.shadow.camera, {left: -3, right: 3, top: 3, bottom: -3, near: 1, far: 12});
scene.add(sun, new THREE.AmbientLight(0xffffff, 0.35));
const Material = setup.lit ? THREE.MeshLambertMaterial : THREE.MeshBasicMaterial;
const solid = (geometry, color) => {
    const mesh = new THREE.Mesh(geometry, new Material({color, side: THREE.DoubleSide}));
    Object.assign(mesh, {castShadow: true, receiveShadow: setup.lit});
    scene.add(mesh);
    return mesh;
};
solid(new THREE.PlaneGeometry(5, 5), 0x9fb89a).rotation.x = -Math.PI / 2;
scene.children[2].position.y = setup.ground;
solid(new THREE.BoxGeometry(0.5, 0.5, 0.5), 0xd0482a).position.set(...setup.box);
const place = (object) => {
    object.scale.set(1.1, 0.9, 1.3);
    object.rotation.set(0.2, setup.turn, 0.1);
    object.castShadow = true;
    scene.add(object);
    return object;
};
const meshed = () => {
    const geometry = new THREE.BufferGeometry(), array = (text, Kind) => new Kind(
        Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
    for (const [name, key] of [["position", "vertices"], ["normal", "normals"], ["color", "colors"]])
        geometry.setAttribute(name, new THREE.BufferAttribute(array(setup[key], Float32Array), 3));
    geometry.setIndex(new THREE.BufferAttribute(array(setup.faces, Uint32Array), 1));
    return new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({vertexColors: THREE.VertexColors ?? true}));
};
const camera = setup.perspective ? new THREE.PerspectiveCamera(fov, 1, 0.1, 20)
    : new THREE.OrthographicCamera(-1.6, 1.6, 1.6, -1.6, 0.1, 20);
camera.position.set(1.2, 1.6, 4.4);
camera.lookAt(0, 0, 0);
window.draw = (traces) => {
    const object = place(traces ? createMesh(THREE) : meshed());
    renderer.render(scene, camera);
    scene.remove(object);
    return canvas.toDataURL();
};
window.pick = (x, y) => {
    const caster = new THREE.Raycaster(), objects = [createMesh(THREE), meshed()].map(place);
    camera.updateMatrixWorld();
    caster.setFromCamera(new THREE.Vector2(x, y), camera);
    return objects.flatMap((object) => {
        object.updateMatrixWorld();
        scene.remove(object);
        return caster.intersectObject(object).map(({distance}) => distance);
    });
};
"""
"""A scene that cuts the model with a plane and a box; `draw(traces)` draws the model, or its meshed copy.

`pick(x, y)` returns the distances of what a ray of the camera meets: first of the model.
"""

WATCH = """
const log = window.log = [];
for (const view of document.querySelectorAll("mplicits-view"))
    for (const type of ["load", "error", "poster-dismissed", "camera-change"])
        view.addEventListener(type, ({detail}) => {
            log.push([view.id, type, detail.source ?? ""]);
            view.setAttribute(`data-${type}`, "");
        });
window.of = (id) => document.getElementById(id);
window.canvases = (id) => of(id).shadowRoot.querySelectorAll("canvas:not(.still)").length;
"""
"""Records the events of a page's elements: [id, type, source]."""


def three_js() -> Path:
    """Return the path of Debian's three.js, release 111. Skips the test where it is not installed."""
    path = Path("/usr/share/javascript/three/three.min.js")
    return path if path.exists() else needs.lack("three.js")


def module_page(field: mplicits.Field, body: str, script: str = "", more: str = "") -> str:
    """Return a page with the module of a model.

    body, more: HTML of the body, and ahead of it. script: it sees the exports.
    """
    text = baked(field.model, poster=False).text
    head, _, exported = text.rpartition("export {")
    assert exported.startswith(EXPORTS[0])
    return f'<!doctype html><meta charset="utf-8">{more}<body>{body}<script type="module">{head}\n{script}</script>'


@cache
def _meshed(field: mplicits.Field, cells: int) -> dict[str, str]:
    """Return the arrays of the meshed copy in base64."""
    mesh = field.mesh(cells, space="model", quiet=True)
    arrays = {
        "vertices": np.asarray(mesh.vertices, "<f4"),
        "normals": np.asarray(mesh.normals, "<f4"),
        "colors": np.asarray(field.color(mesh.vertices), "<f4"),
        "faces": np.asarray(mesh.faces, "<u4"),
    }
    return {name: base64.b64encode(array.tobytes()).decode() for name, array in arrays.items()}


def three_page(field: mplicits.Field, folder: Path, *, cells: int, **setup: Any) -> Path:
    """Write the page of SCENE.

    cells: of the meshed copy, along an edge. setup: size, perspective, lit, ground, box, turn.
    """
    usual = {"size": 256, "fov": FOV, "perspective": True, "lit": False, "ground": -0.4, "box": [0.5, 0.1, 0.3]}
    script = f"const setup = {json.dumps(usual | {'turn': 0.5} | setup | _meshed(field, cells))};{SCENE}"
    path = folder / "three.html"
    library = f"<script>{three_js().read_text(encoding='utf-8')}</script>"
    path.write_text(module_page(field, "<canvas></canvas>", script, library), encoding="utf-8")
    return path


def drawn(page: "Page", traces: bool) -> NDArray[np.uint8]:
    """Return the picture of SCENE, (size, size, 3)."""
    url = page.evaluate("traces => draw(traces)", traces)
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(url.partition(",")[2]))).convert("RGB"))
