"""The window under Xvfb: dropped and watched files, exports, and closing during a training."""

from pathlib import Path

import pytest

from mplicits.codegen.targets.glsl330 import standalone
from mplicits.model.model_file import save
from support import needs
from support.fitted_model import fitted_model
from support.random_model import random_model
from support.viewer_fixture import TETRAHEDRON
from support.window_script import run

FILES = """
from mplicits.viewer.state.exports import free_path, save_picture
from mplicits.viewer.state.jobs import write_target, write_video
view.options = RenderOptions()
drop = lambda name: window._on_drop(handle, [str(Path(name).absolute())])
settle()
drop("other.safetensors"); settle(); report["model"] = [viewer.source.name, difference()]
drop("bad.safetensors"); settle(); report["broken"] = [viewer.source.name, viewer.message]
drop("shader.glsl"); settle(); report["shader"] = [viewer.source.name, difference()]
before = screen()
text = Path("shader.glsl").read_text()
Path("shader.glsl").write_text(text.replace("vec3 toward = normalize(", "vec3 toward = normalise("))
end = time.perf_counter() + 300
while not viewer.log and time.perf_counter() < end:
    window.step()
    time.sleep(0.02)
settle()
x, y, width, height = window.area
report["log"] = viewer.log
viewer.log, viewer.message = [], ""
report["kept"] = float(np.abs(screen() - before)[:, x:].max())
Path("shader.glsl").write_text(text)
while viewer.files._watch.changed():
    pass
drop("other.safetensors"); settle()
for name in ("model", "c"):
    viewer.work.begin(write_target(name, viewer.source.model, free_path("export", "." + name)))
    settle()
save_picture(viewer, (40, 30)); settle()
video = write_video(viewer.current_renderer(), free_path("fitted", ".mp4"), view.scene((24, 16)), (32, 24), 0.2, 10)
viewer.work.begin(video, draws=True); settle()
report["exports"] = sorted(path.name for path in Path().iterdir() if path.stem in ("export", "fitted"))
drop("shape.obj")
for _ in range(20):
    window.step()
    time.sleep(0.02)
report["training"] = [viewer.work.training.running, str(viewer.work.training.model.parent)]
"""


@pytest.mark.slow
def test_a_window_drops_watches_and_exports_files_and_ends_its_training(tmp_path: Path, xvfb: dict[str, str]) -> None:
    needs.package("av")
    save(random_model((4, 0), name="first"), tmp_path / "m.safetensors")
    save(fitted_model((20, 32)), tmp_path / "other.safetensors")
    (tmp_path / "bad.safetensors").write_bytes(b"\0" * 40)
    (tmp_path / "shader.glsl").write_text(standalone(fitted_model((20, 32))), encoding="utf-8")
    (tmp_path / "shape.obj").write_text(TETRAHEDRON)
    report = run(FILES, (64, 48), tmp_path, xvfb, watch=True)
    for kind in ("model", "shader"):
        name, off = report[kind]
        assert name == "fitted"
        assert off < 1.1 / 255, "what the window shows is what render draws"
    name, message = report["broken"]
    assert name == "fitted"
    assert "bad.safetensors" in message
    line = next(k for k, text in enumerate(standalone(fitted_model((20, 32))).splitlines(), 1) if "vec3 toward" in text)
    assert f"line {line}" in report["log"][0]
    assert report["kept"] == 0.0, "the last good picture stays"
    assert report["exports"] == ["export.c", "export.model", "fitted.mp4", "fitted.png"]
    running, folder = report["training"]
    assert running
    assert not Path(folder).exists(), "closing the window ended the training"
