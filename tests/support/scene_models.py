"""Scenes of small models without training."""

from dataclasses import replace
from pathlib import Path

from mplicits.model.model import Model
from mplicits.model.model_file import save
from mplicits.scenes.compose import compose
from support.fitted_model import fitted_model

SCENE = """
name = "three balls"
[[parts]]
model = "ball.safetensors"
translate = [-1.2, "0.3 * t", 0]
angle = "90 * t"
axis = [0, 1, 1]
[[parts]]
operation = "smooth union"
radius = 0.3
translate = [0.9, 0, 0]
[[parts.parts]]
model = "ball.safetensors"
[[parts.parts]]
model = "coarse.safetensors"
translate = [0.2, 0.9, 0]
scale = 0.6
[[parts]]
operation = "difference"
translate = [0, 0, -1.9]
[[parts.parts]]
model = "ball.safetensors"
[[parts.parts]]
model = "ball.safetensors"
translate = [0.2, 0.5, 0.5]
scale = "0.7 + 0.1 * t"
[ground]
height = -1
"""
"""A moving scene with every operation but the intersection."""
STILL = SCENE.replace('"0.3 * t"', "0.1").replace('"90 * t"', "30").replace('"0.7 + 0.1 * t"', "0.75")
"""SCENE at one time."""
SMALL = """
[[parts]]
model = "ball.safetensors"
translate = ["0.6 * t", 0, 0]
[ground]
radius = 1.2
color = [0.2, 0.5, 0.3]
"""
"""A ball that moves over a plate."""


def write_balls(folder: Path, widths: tuple[int, int] = (24, 48)) -> None:
    """Write the models of SCENE. widths: of their levels."""
    ball = fitted_model(widths)
    save(ball, folder / "ball.safetensors")
    save(replace(ball, levels=ball.levels[:1], texture=None), folder / "coarse.safetensors")


def composed(folder: Path, text: str = SCENE, widths: tuple[int, int] = (24, 48)) -> Model:
    """Compose a scene from a text, next to the models of `write_balls`."""
    write_balls(folder, widths)
    (folder / "scene.toml").write_text(text)
    return compose(folder / "scene.toml")
