"""The studio in Chromium: a page with quick trainings, a ball to drop, and what its buttons save."""

import dataclasses
import time
from pathlib import Path

import numpy as np
import trimesh

from mplicits.trainer.config import TrainingConfig
from mplicits.web.studio_page import studio

from .ball_training import QUICK
from .browser import PATIENCE, Visit

CONFIG = dataclasses.replace(TrainingConfig(), sampling=QUICK.sampling, measuring=QUICK.measuring)
CENTER, RADIUS = np.array([1.0, 2.0, 3.0]), 4.0
_RECORDED = """() => new Promise((resolve, reject) => {
    const opening = indexedDB.open("mplicits-studio", 1);
    opening.onerror = () => reject(opening.error);
    opening.onsuccess = () => {
        const asked = opening.result.transaction("records").objectStore("records").get("last");
        asked.onerror = () => reject(asked.error);
        asked.onsuccess = () => {
            opening.result.close();
            resolve(asked.result ? [asked.result.levels.length, Boolean(asked.result.texture)] : null);
        };
    };
})"""


def write_page(path: Path, steps: int | tuple[int, int, int]) -> Path:
    """Write a studio whose trainings take `steps` steps: for each network, or for the two levels and the texture."""
    layouts = [{"width": 14, "depth": 1}] * 2
    fixed = {
        "levels": layouts,
        "texture": layouts[0],
        "omegas": [19, 37, 23],
        "steps": (steps,) * 3 if isinstance(steps, int) else steps,
        "seconds": 1,
        "seed": 0,
        "packed": True,
    }
    path.write_text(studio(CONFIG, fixed), encoding="utf-8")
    return path


def ball() -> bytes:
    """Return an STL file."""
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=RADIUS)
    mesh.apply_translation(CENTER)
    return bytes(mesh.export(file_type="stl"))


def save(visited: Visit, button: str, path: Path) -> str:
    """Save what a button offers. Returns the file's suggested name."""
    with visited.page.expect_download() as download:
        visited.page.click(button)
    download.value.save_as(path)
    return download.value.suggested_filename


def ready(visited: Visit) -> None:
    """Wait until the page listens."""
    visited.until("'ready' in document.documentElement.dataset")


def recorded(visited: Visit) -> list[object] | None:
    """Return what a reload would offer, web/stage/storage.js: the count of levels, and whether it has a texture."""
    record: list[object] | None = visited.page.evaluate(_RECORDED)
    return record


def until_recorded(visited: Visit, levels: int, texture: bool) -> None:
    """Wait until a reload would offer this count of levels, with or without a texture."""
    end = time.monotonic() + PATIENCE / 1000
    while recorded(visited) != [levels, texture]:
        assert time.monotonic() < end, f"{recorded(visited)} is recorded"
        visited.page.wait_for_timeout(100)
