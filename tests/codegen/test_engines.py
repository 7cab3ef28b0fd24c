"""The texts of docs/engines.md, run in the engines, equal the numpy reference."""

import base64
import json
import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import mplicits
from support import needs
from support.browser import PATIENCE, listen
from support.compilers import check_hlsl
from support.engine_pictures import DISTANCE, FOV, SIDE, assert_shows, documented
from support.module_pages import three_js
from support.paths import DEMO

if TYPE_CHECKING:
    from playwright.sync_api import Browser

FIELD = mplicits.load(DEMO)
BACKGROUND = 77
OLDER_GODOT = {
    "MODEL_MATRIX": "WORLD_MATRIX",
    "CAMERA_POSITION_WORLD": "CAMERA_MATRIX[3].xyz",
}
"""Name in Godot 4 -> name in Godot 3."""
SCENE = f"""extends SceneTree
func _init():
    var view = Viewport.new()
    view.size = Vector2({SIDE}, {SIDE})
    view.own_world = true
    view.render_target_update_mode = Viewport.UPDATE_ALWAYS
    view.render_target_v_flip = true
    get_root().add_child(view)
    var around = Environment.new()
    around.background_mode = Environment.BG_COLOR
    around.background_color = Color8({BACKGROUND}, {BACKGROUND}, {BACKGROUND})
    var box = MeshInstance.new()
    box.mesh = CubeMesh.new()
    var material = ShaderMaterial.new()
    material.shader = load("res://spot.shader")
    box.material_override = material
    view.add_child(box)
    var camera = Camera.new()
    camera.environment = around
    view.add_child(camera)
    camera.translation = Vector3(0, 0, {DISTANCE})
    camera.fov = {FOV}
    camera.current = true
    for i in range(4):
        yield(self, "idle_frame")
    view.get_texture().get_data().save_png("res://shown.png")
    quit()
"""
PAGE = f"""<!doctype html><canvas width="{SIDE}" height="{SIDE}"></canvas>
<script src="three.min.js"></script><script src="text.js"></script><script>
const canvas = document.querySelector("canvas"), scene = new THREE.Scene();
const context = canvas.getContext("webgl2", {{preserveDrawingBuffer: true, antialias: false}});
const renderer = new THREE.WebGLRenderer({{canvas, context}});
const camera = new THREE.PerspectiveCamera({FOV}, 1, 0.1, 10);
camera.position.z = {DISTANCE};
renderer.setClearColor({BACKGROUND * 0x010101});
SNIPPET
renderer.render(scene, camera);
</script>"""


def pixels(path: Path) -> NDArray[np.uint8]:
    """Read a PNG, (H, W, 3)."""
    return np.asarray(Image.open(path).convert("RGB"))


@pytest.mark.slow
def test_godot_draws_the_model(xvfb: dict[str, str], tmp_path: Path) -> None:
    needs.program("Godot")
    text = documented("Godot")
    for name, older in OLDER_GODOT.items():
        assert name in text
        text = text.replace(name, older)
    text = text.replace('#include "res://spot.gdshaderinc"', FIELD.bake("glsl", name="spot"))
    (tmp_path / "spot.shader").write_text(text)
    (tmp_path / "show.gd").write_text(SCENE.replace("    ", "\t"))
    (tmp_path / "project.godot").write_text("config_version=4\n")
    command = ["godot3", "--path", str(tmp_path), "-s", "show.gd", "--audio-driver", "Dummy"]
    done = subprocess.run(command, env=xvfb, capture_output=True, text=True, timeout=600, check=True)
    assert "SHADER ERROR" not in done.stdout + done.stderr
    assert_shows(pixels(tmp_path / "shown.png"), FIELD)


@pytest.mark.slow
def test_three_js_draws_the_model(browser: "Browser", tmp_path: Path) -> None:
    shutil.copy(three_js(), tmp_path)
    (tmp_path / "text.js").write_text(f"const spotGlsl = {json.dumps(FIELD.bake('glsl', name='spot'))};\n")
    (tmp_path / "page.html").write_text(PAGE.replace("SNIPPET", documented("A material of three.js")))
    context = browser.new_context(offline=True)
    context.set_default_timeout(PATIENCE)
    page, messages = context.new_page(), list[str]()
    listen(page, messages)
    page.goto((tmp_path / "page.html").as_uri())
    url = page.evaluate("() => canvas.toDataURL()")
    context.close()
    assert messages == []
    (tmp_path / "shown.png").write_bytes(base64.b64decode(url.partition(",")[2]))
    assert_shows(pixels(tmp_path / "shown.png"), FIELD)


@pytest.mark.slow
def test_blender_moves_a_mesh_to_the_surface(tmp_path: Path) -> None:
    needs.program("Blender")
    FIELD.bake("python", tmp_path / "spot.py", name="spot")
    (tmp_path / "text.py").write_text(documented("Blender"))
    (tmp_path / "run.py").write_text(f"""
import bpy
bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5)
bpy.ops.wm.save_as_mainfile(filepath={str(tmp_path / "scene.blend")!r})
exec(bpy.data.texts.load({str(tmp_path / "text.py")!r}).as_string())
np.save({str(tmp_path / "vertices.npy")!r}, [v.co for v in bpy.context.object.data.vertices])
""")
    command = ["blender", "--background", "--factory-startup", "--python-exit-code", "3", "--python"]
    done = subprocess.run(
        [*command, str(tmp_path / "run.py")], capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    vertices = np.load(tmp_path / "vertices.npy")
    assert len(vertices) > 2000
    assert (np.quantile(np.abs(FIELD(vertices)), [0.5, 0.9]) < [1e-4, 2e-3]).all()
    assert np.ptp(np.linalg.norm(vertices, axis=1)) > 0.3, "it was a sphere"


@pytest.mark.parametrize("engine", ["Unity", "Unreal"])
def test_the_text_for_an_hlsl_engine_compiles(engine: str, tmp_path: Path) -> None:
    text, field = documented(engine), FIELD.bake("hlsl", name="spot")
    if engine == "Unity":
        text = text.replace('#include "Spot.hlsl"', field)
        used = "float d; float3 n; SpotField_float(float3(at.xy, 0.), d, n); return float4(n, d);"
    else:
        # Unreal wraps the node's text in a function.
        text = f"{field}float CustomExpression0(float3 p)\n{{\n{text}}}\n"
        used = "return CustomExpression0(float3(at.xy, 0.));"
    check_hlsl(f"{text}float4 main(float4 at : SV_Position) : SV_Target {{ {used} }}\n", tmp_path)


def test_a_cpp_program_links_the_c_text(tmp_path: Path) -> None:
    needs.program("g++")
    lines = documented("C, C++, Rust, Zig, ...").splitlines()
    compiles = [line.partition("&& ")[2] for line in lines if "&&" in line]
    declared = [line for line in lines if line.startswith("extern")]
    assert (len(compiles), len(declared)) == (1, 2)
    FIELD.bake("c", tmp_path / "spot.c", name="spot")
    subprocess.run(compiles[0].split(), cwd=tmp_path, check=True)
    (tmp_path / "main.cpp").write_text(f"""
#include <cstdio>
extern "C" {{
{chr(10).join(declared)}
}}
int main() {{
    float p[3];
    while (std::fread(p, 4, 3, stdin) == 3) {{
        float f = spot(p);
        std::fwrite(&f, 4, 1, stdout);
    }}
}}
""")
    subprocess.run(["g++", "main.cpp", "spot.o", "-o", "main", "-lm"], cwd=tmp_path, check=True)
    points = np.random.default_rng(0).uniform(-1, 1, (1000, 3)).astype(np.float32)
    done = subprocess.run([str(tmp_path / "main")], input=points.tobytes(), capture_output=True, check=True)
    np.testing.assert_allclose(np.frombuffer(done.stdout, np.float32), FIELD(points), atol=1e-5)
