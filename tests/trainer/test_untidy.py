"""Meshes with quads and n-gons, several objects, unused vertices, and edges of more than two faces."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from mplicits import cli
from mplicits.model.model_file import load
from mplicits.trainer.shapes.load import load_shape

CUBE = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
SIDES = 7
RING = [(np.cos(angle), np.sin(angle)) for angle in 2 * np.pi * np.arange(SIDES) / SIDES]

Point = tuple[float, float, float]


def obj(vertices: Sequence[Sequence[float]], faces: Sequence[Sequence[int]], first: int = 0) -> str:
    """Write OBJ text. first: number of earlier vertices in the file."""
    lines = ["v " + " ".join(map(str, vertex)) for vertex in vertices]
    lines += ["f " + " ".join(str(first + index + 1) for index in face) for face in faces]
    return "\n".join(lines) + "\n"


def moved(x: float, y: float) -> list[Point]:
    return [(a + x, b + y, c) for a, b, c in CUBE]


def prism() -> str:
    """A prism on a polygon of seven corners."""
    top = [(x, y, 1.0) for x, y in RING]
    sides = [(i, (i + 1) % SIDES, SIDES + (i + 1) % SIDES, SIDES + i) for i in range(SIDES)]
    caps = [tuple(range(SIDES))[::-1], tuple(range(SIDES, 2 * SIDES))]
    return obj([(x, y, 0.0) for x, y in RING] + top, [*sides, *caps])


def soup() -> str:
    """A cube whose faces share no vertices, with one duplicate face and an unused vertex far away."""
    corners = [CUBE[index] for face in [*QUADS, QUADS[0]] for index in face]
    return obj([*corners, (50, 0, 0)], np.arange(len(corners)).reshape(-1, 4).tolist())


def edge_to_edge() -> str:
    """Two cubes that share one edge."""
    other = moved(1, 1)
    corners = list(dict.fromkeys([*CUBE, *other]))
    assert len(corners) == 14
    return obj(corners, [*QUADS, *([corners.index(other[index]) for index in face] for face in QUADS)])


FIN = obj([*CUBE, (0.5, 1.5, 1.5)], [*QUADS, (3, 7, 8)])
UNTIDY: dict[str, tuple[str, list[tuple[Point, float]]]] = {
    "quads": (obj(CUBE, QUADS), [((0.5, 0.5, 0.5), -0.5), ((0.5, 0.5, 1.25), 0.25)]),
    "n-gons": (prism(), [((0, 0, 0.5), -0.5), ((0.8, 0, 0.9), -0.1), ((0, 0, 1.25), 0.25)]),
    "objects": (
        f"o a\n{obj(CUBE, QUADS)}o b\n{obj(moved(3, 0), QUADS, 8)}",
        [((0.5, 0.5, 0.5), -0.5), ((3.5, 0.5, 0.5), -0.5), ((2, 0.5, 0.5), 1.0)],
    ),
    "soup": (soup(), [((0.5, 0.5, 0.5), -0.5), ((0.5, 0.5, 1.25), 0.25)]),
    "cubes with one edge": (edge_to_edge(), [((0.5, 0.5, 0.5), -0.5), ((1.5, 1.5, 0.5), -0.5), ((1.5, 0.5, 0.5), 0.5)]),
    "three faces at an edge": (FIN, [((0.5, 0.5, 0.5), -0.5), ((0.5, 0.5, 1.25), 0.25)]),
}
"""Name -> the file's text, and distances at points."""


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("name", UNTIDY)
def test_an_untidy_mesh_has_exact_distances_and_trains(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, known = UNTIDY[name]
    path, output = tmp_path / "mesh.obj", tmp_path / "mesh.safetensors"
    path.write_text(text)
    shape, _ = load_shape(str(path))
    points, expected = (np.array(column, np.float64) for column in zip(*known, strict=True))
    found = shape.distance((points - shape.center) / shape.scale) * shape.scale
    np.testing.assert_allclose(found, expected, atol=1e-6)
    argv = ["train", str(path), "-o", str(output), "--levels", "4x0", "--steps", "3", "--quiet", "--flat"]
    assert cli.main(argv) == 0
    warnings = capsys.readouterr().err.splitlines()
    assert len([line for line in warnings if "the model's surface" not in line]) <= 1, "of the mesh, one at the most"
    assert load(output).scale == pytest.approx(shape.scale)
