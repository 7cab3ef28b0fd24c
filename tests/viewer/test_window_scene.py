"""A scene in the window: its picture, and its motion."""

from pathlib import Path

import pytest

from mplicits.model.model_file import save
from support.scene_models import SMALL, composed
from support.window_script import run

SCRIPT = """
settle()
report["picture"] = difference()
report["plays"] = view.moves
before = screen()
view.set(time=1.0)
settle()
report["moved"] = float(np.abs(screen() - before).max())
report["then"] = difference()
"""


@pytest.mark.slow
def test_a_scene_is_drawn_and_moves_in_the_window(tmp_path: Path, xvfb: dict[str, str]) -> None:
    save(composed(tmp_path, SMALL), tmp_path / "m.safetensors")
    report = run(SCRIPT, (96, 64), tmp_path, xvfb)
    assert report["picture"] < 0.02
    assert report["then"] < 0.02
    assert report["plays"]
    assert report["moved"] > 0.3
