"""What glTF says of shapes and base colors, kind by kind, against values computed by hand."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from mplicits.model.errors import UserError
from mplicits.model.srgb import to_linear, to_srgb
from mplicits.readers.content import Mesh
from mplicits.readers.read import read_shape
from support.written_glb import Glb

Document = dict[str, Any]
SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], np.float32)
UV = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], np.float32)
"""glTF's v points down: the image's upper left corner is at (0, 0)."""
TEXELS = np.random.default_rng(0).integers(0, 256, (4, 4, 3)).astype(np.uint8)


class Scene:
    """A square with an image of 4 x 4 texels, and what a test adds."""

    def __init__(self) -> None:
        self.glb = Glb()
        self.position = self.glb.array(SQUARE, "VEC3", 5126)
        index = self.glb.view(np.array([0, 1, 2, 0, 2, 3], np.uint8).tobytes())
        indices = self.glb.described(bufferView=index, type="SCALAR", componentType=5121, count=6)
        self.attributes: Document = {"POSITION": self.position, "TEXCOORD_0": self.glb.array(UV, "VEC2", 5126)}
        self.primitive: Document = {"attributes": self.attributes, "indices": indices, "material": 0}
        self.texture: Document = {"index": 0}
        self.base: Document = {"baseColorTexture": self.texture}
        self.sampler: Document = {"magFilter": 9728}
        self.node: Document = {"mesh": 0}
        self.mesh: Document = {"primitives": [self.primitive]}
        self.more: Document = {}

    def read(self, folder: Path) -> Mesh:
        data = io.BytesIO()
        Image.fromarray(TEXELS).save(data, "PNG")
        self.glb.document |= {
            "images": [{"bufferView": self.glb.view(data.getvalue()), "mimeType": "image/png"}],
            "textures": [{"source": 0, "sampler": 0}],
            "samplers": [self.sampler],
            "materials": [{"pbrMetallicRoughness": self.base}],
            "meshes": [self.mesh],
            "nodes": [self.node],
            "scenes": [{"nodes": [0]}],
            **self.more,
        }
        (folder / "a.glb").write_bytes(self.glb.to_bytes())
        content = read_shape(folder / "a.glb")
        assert isinstance(content, Mesh)
        return content


def color_at(mesh: Mesh, x: float, y: float) -> np.ndarray[Any, Any]:
    """The color at a place of the square, in its first triangle that holds it."""
    assert mesh.paint is not None
    for face, corners in enumerate(mesh.vertices[mesh.faces]):
        weights = np.linalg.solve(np.vstack((corners[:, :2].T, np.ones(3))), (x, y, 1))
        if weights.min() > -1e-9:
            return np.asarray(mesh.paint.at(np.array([face]), weights[None, :, None])[0])
    raise AssertionError("the place is outside")


def texel(row: int, column: int) -> np.ndarray[Any, Any]:
    return np.asarray(TEXELS[row, column] / 255)


CENTERS = [(x, y) for x in (0.125, 0.375, 0.625, 0.875) for y in (0.125, 0.875)]


def test_the_first_row_of_an_image_is_at_v_0(tmp_path: Path) -> None:
    mesh = Scene().read(tmp_path)
    for x, y in CENTERS:
        np.testing.assert_allclose(color_at(mesh, x, y), texel(int((1 - y) * 4), int(x * 4)), atol=1e-6)


@pytest.mark.parametrize("by", ["texCoord", "transform"])
def test_a_second_set_of_coordinates(tmp_path: Path, by: str) -> None:
    scene = Scene()
    scene.attributes["TEXCOORD_1"] = scene.glb.array(UV[:, ::-1].copy(), "VEC2", 5126)
    scene.texture |= {"texCoord": 1} if by == "texCoord" else {"extensions": {"KHR_texture_transform": {"texCoord": 1}}}
    mesh = scene.read(tmp_path)
    for x, y in CENTERS:
        np.testing.assert_allclose(color_at(mesh, x, y), texel(int(x * 4), int((1 - y) * 4)), atol=1e-6)


def test_a_transform_scales_turns_and_moves(tmp_path: Path) -> None:
    scene = Scene()
    changed = {"offset": [0.25, 1.0], "rotation": np.pi / 2, "scale": [0.5, 0.5]}
    scene.texture["extensions"] = {"KHR_texture_transform": changed}
    mesh = scene.read(tmp_path)
    for x, y in ((0.25, 0.25), (0.75, 0.75), (0.25, 0.75)):
        u, v = x * 0.5, (1 - y) * 0.5
        column, row = (0.25 + v) * 4 - 0.5, (1.0 - u) * 4 - 0.5  # the specification's matrix, by hand
        low, left = int(np.floor(row)), int(np.floor(column))
        down, across = row - low, column - left
        at = [[texel((low + i) % 4, (left + j) % 4) for j in (0, 1)] for i in (0, 1)]
        rows = [at[i][0] * (1 - across) + at[i][1] * across for i in (0, 1)]
        np.testing.assert_allclose(color_at(mesh, x, y), rows[0] * (1 - down) + rows[1] * down, atol=1e-6)


@pytest.mark.parametrize(("wrap", "columns"), [(10497, (0, 1, 2, 3)), (33071, (3, 3, 3, 3)), (33648, (3, 2, 1, 0))])
def test_images_continue_as_their_sampler_says(tmp_path: Path, wrap: int, columns: tuple[int, ...]) -> None:
    scene = Scene()
    scene.attributes["TEXCOORD_0"] = scene.glb.array(UV + np.array([1, 0], np.float32), "VEC2", 5126)
    scene.sampler |= {"wrapS": wrap}
    mesh = scene.read(tmp_path)
    for k, column in enumerate(columns):
        np.testing.assert_allclose(color_at(mesh, 0.125 + 0.25 * k, 0.625), texel(1, column), atol=1e-6)


def test_factor_texture_and_vertex_colors_multiply_in_linear_light(tmp_path: Path) -> None:
    scene = Scene()
    scene.base["baseColorFactor"] = [0.5, 1.0, 0.25, 1.0]
    tints = np.full((4, 4), 128, np.uint8)
    scene.attributes["COLOR_0"] = scene.glb.array(tints, "VEC4", 5121, normalized=True)
    mesh = scene.read(tmp_path)
    for x, y in CENTERS:
        linear = to_linear(texel(int((1 - y) * 4), int(x * 4))) * np.array((0.5, 1.0, 0.25)) * 128 / 255
        np.testing.assert_allclose(color_at(mesh, x, y), to_srgb(linear), atol=1e-6)


def test_texture_coordinates_of_bytes_are_normalized(tmp_path: Path) -> None:
    scene = Scene()
    table = (UV * 255).astype(np.uint8)
    scene.attributes["TEXCOORD_0"] = scene.glb.array(table, "VEC2", 5121, normalized=True)
    np.testing.assert_allclose(color_at(scene.read(tmp_path), 0.125, 0.875), texel(0, 0), atol=1e-6)


@pytest.mark.parametrize(("mode", "order"), [(5, (0, 1, 3, 2)), (6, (0, 1, 2, 3))])
def test_strips_and_fans(tmp_path: Path, mode: int, order: tuple[int, ...]) -> None:
    scene = Scene()
    view = scene.glb.view(np.array(order, np.uint16).tobytes())
    scene.primitive |= {
        "mode": mode,
        "indices": scene.glb.described(bufferView=view, type="SCALAR", componentType=5123, count=4),
    }
    mesh = scene.read(tmp_path)
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    np.testing.assert_allclose(np.cross(b - a, c - a)[:, 2], [1, 1])


def test_lines_are_no_triangles(tmp_path: Path) -> None:
    scene = Scene()
    lines = {"attributes": {"POSITION": scene.position}, "mode": 1}
    scene.mesh["primitives"].append(lines)
    assert len(scene.read(tmp_path).faces) == 2


def test_morph_targets_have_their_default_weights(tmp_path: Path) -> None:
    scene = Scene()
    moved = scene.glb.array(np.tile(np.array([[0, 0, 2]], np.float32), (4, 1)), "VEC3", 5126)
    up = scene.glb.array(np.tile(np.array([[0, 0, 1]], np.float32), (4, 1)), "VEC3", 5126)
    scene.attributes["NORMAL"] = up
    scene.primitive["targets"] = [{"POSITION": moved, "NORMAL": moved}]
    scene.mesh["weights"] = [0.5]
    mesh = scene.read(tmp_path)
    assert mesh.vertices[:, 2].tolist() == [1.0] * 4
    assert mesh.normals is not None
    assert mesh.normals.values.tolist() == [[0, 0, 2]] * 4


def test_a_mirror_keeps_the_side_of_faces(tmp_path: Path) -> None:
    scene = Scene()
    scene.node["scale"] = [-1, 1, 1]
    scene.attributes["NORMAL"] = scene.glb.array(np.tile(np.array([[-1, 0, 1]], np.float32), (4, 1)), "VEC3", 5126)
    mesh = scene.read(tmp_path)
    assert mesh.normals is not None
    assert mesh.normals.values.tolist() == [[1, 0, 1]] * 4
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_a_matrix_is_stored_by_columns(tmp_path: Path) -> None:
    scene = Scene()
    matrix = np.array([(0, -2, 0, 5), (2, 0, 0, 6), (0, 0, 2, 7), (0, 0, 0, 1.0)])
    scene.node["matrix"] = matrix.T.ravel().tolist()
    np.testing.assert_allclose(scene.read(tmp_path).vertices, (SQUARE @ matrix[:3, :3].T) + matrix[:3, 3])


def test_instances_turn_and_scale(tmp_path: Path) -> None:
    scene = Scene()
    parts = {
        "TRANSLATION": (np.array([(1, 0, 0), (0, 5, 0)], np.float32), "VEC3"),
        "ROTATION": (np.array([(0, 0, 0, 1), (0, 0, np.sqrt(0.5), np.sqrt(0.5))], np.float32), "VEC4"),
        "SCALE": (np.array([(1, 1, 1), (2, 3, 1)], np.float32), "VEC3"),
    }
    attributes = {name: scene.glb.array(array, kind, 5126) for name, (array, kind) in parts.items()}
    scene.node["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    mesh = scene.read(tmp_path)
    turned = (SQUARE * (2, 3, 1))[:, [1, 0, 2]] * (-1, 1, 1) + (0, 5, 0)
    np.testing.assert_allclose(mesh.vertices, np.concatenate((SQUARE + np.array((1, 0, 0)), turned)), atol=1e-6)
    assert mesh.facts.meshes == 2


def test_a_skin_of_two_joints_blends_them(tmp_path: Path) -> None:
    scene = Scene()
    joints = np.tile(np.array([[0, 1, 0, 0]], np.uint8), (4, 1))
    weights = np.array([(1, 0, 0, 0), (0.5, 0.5, 0, 0), (0, 1, 0, 0), (0.25, 0.75, 0, 0)], np.float32)
    scene.attributes |= {
        "JOINTS_0": scene.glb.array(joints, "VEC4", 5121),
        "WEIGHTS_0": scene.glb.array(weights, "VEC4", 5126),
    }
    scene.node |= {"skin": 0, "translation": [100, 100, 100]}  # which a skin ignores
    nodes = [scene.node, {"translation": [0, 0, 1], "children": [2]}, {"translation": [0, 0, 2]}]
    scene.more = {"nodes": nodes, "scenes": [{"nodes": [0, 1]}], "skins": [{"joints": [1, 2]}]}
    mesh = scene.read(tmp_path)
    np.testing.assert_allclose(mesh.vertices[:, 2], 1 * weights[:, 0] + 3 * weights[:, 1])
    np.testing.assert_allclose(mesh.vertices[:, :2], SQUARE[:, :2])


def test_hidden_nodes_and_other_scenes_are_left_out(tmp_path: Path) -> None:
    scene = Scene()
    hidden = {"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": False}}}
    scene.more = {"nodes": [scene.node, hidden, {"mesh": 0}], "scenes": [{"nodes": [0, 1]}, {"nodes": [2]}], "scene": 0}
    assert len(scene.read(tmp_path).faces) == 2


def test_materials_keep_to_their_faces(tmp_path: Path) -> None:
    scene = Scene()
    other = scene.glb.array(SQUARE + np.array([2, 0, 0], np.float32), "VEC3", 5126)
    scene.mesh["primitives"].append({**scene.primitive, "attributes": {"POSITION": other}, "material": 1})
    red = {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.0, 0.0, 1.0]}}
    scene.more = {"materials": [{"pbrMetallicRoughness": scene.base}, red]}
    mesh = scene.read(tmp_path)
    np.testing.assert_allclose(color_at(mesh, 2.5, 0.4), to_srgb(np.array((0.5, 0, 0))), atol=1e-6)
    np.testing.assert_allclose(color_at(mesh, 0.125, 0.875), texel(0, 0), atol=1e-6)


@pytest.mark.parametrize("factor", [None, [1, 1, 1, 1], [0.8, 0.8, 0.8, 1]])
def test_a_placeholder_is_no_color(tmp_path: Path, factor: list[float] | None) -> None:
    scene = Scene()
    del scene.attributes["TEXCOORD_0"], scene.base["baseColorTexture"]
    scene.base |= {} if factor is None else {"baseColorFactor": factor}
    assert scene.read(tmp_path).paint is None


def test_an_image_without_its_coordinates_is_said(tmp_path: Path) -> None:
    scene = Scene()
    scene.texture["texCoord"] = 1
    mesh = scene.read(tmp_path)
    assert mesh.paint is None
    assert mesh.facts.warnings == ["an image is not used: its set of texture coordinates is missing"]


def test_colors_above_1_are_said(tmp_path: Path) -> None:
    scene = Scene()
    scene.attributes["COLOR_0"] = scene.glb.array(np.full((4, 3), 200, np.float32), "VEC3", 5126)
    assert "COLOR_0 exceeds 1" in scene.read(tmp_path).facts.warnings[0]


def test_an_image_that_is_missing_is_named(tmp_path: Path) -> None:
    scene = Scene()
    scene.more = {"images": [{"uri": "wood.png"}]}
    mesh = scene.read(tmp_path)
    assert mesh.paint is None
    assert mesh.facts.warnings == [
        "texture coordinates, but no readable image (wood.png: not found beside the file); name it with --texture FILE"
    ]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"nodes": [{"children": [1]}, {"children": [0]}]}, "its own parent"),
        ({"scenes": [{"nodes": [9]}]}, "nodes: there is no 9"),
        ({"nodes": [{"mesh": 5}]}, "meshes: there is no 5"),
        ({"bufferViews": []}, "bufferViews: there is no"),
        ({"accessors": [{"componentType": 1, "type": "VEC3", "count": 1}]}, "no known type"),
        ({"extensionsRequired": ["EXT_unheard_of"]}, "requires the extension EXT_unheard_of"),
        ({"asset": {"version": "1.0"}}, "convert it to glTF 2.0"),
    ],
)
def test_damage_is_one_line(tmp_path: Path, change: Document, says: str) -> None:
    scene = Scene()
    scene.more = change
    with pytest.raises(UserError, match=says) as refused:
        scene.read(tmp_path)
    assert "\n" not in str(refused.value)
    assert str(refused.value).startswith("a.glb: ")
