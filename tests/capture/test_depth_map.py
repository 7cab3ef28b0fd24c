"""Reading depth maps and cameras, and errors for bad files."""

import json
import struct
import zlib
from collections.abc import Callable
from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from mplicits.capture.depth_map import read_depth, step_of
from mplicits.capture.intrinsics import Intrinsics, of_file, of_photograph, of_view
from mplicits.model.errors import UserError
from support import needs

METERS = np.linspace(0.5, 3.0, 12 * 16).reshape(12, 16)


def exr(channel: str) -> Callable[[Path, NDArray[np.float64]], None]:
    """Return a writer of EXR files with one channel."""

    def write(path: Path, depth: NDArray[np.float64]) -> None:
        openexr = needs.package("OpenEXR")
        header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
        openexr.File(header, {channel: depth.astype(np.float32)}).write(str(path))

    return write


def millimeters(path: Path, depth: NDArray[np.float64]) -> None:
    """Write integer millimeters, 16 bits."""
    Image.fromarray(np.rint(depth * 1000).astype(np.uint16)).save(path)


def gray_of_three_channels(path: Path, depth: NDArray[np.float64]) -> None:
    """Write 8-bit integers as RGB."""
    Image.fromarray(np.repeat(np.rint(depth * 80).astype(np.uint8)[..., None], 3, axis=2)).save(path)


@pytest.mark.parametrize(
    ("name", "write", "unit", "tolerance"),
    [
        ("d.png", millimeters, 1000, 5e-4),
        ("d.png", gray_of_three_channels, 80, 7e-3),
        ("d.tiff", lambda path, depth: Image.fromarray(depth.astype(np.float32)).save(path), None, 1e-6),
        ("d.npy", lambda path, depth: np.save(path, depth[None]), None, 0),
        ("d.exr", exr("Z"), None, 1e-6),
        ("d.EXR", exr("ViewLayer.Depth.V"), None, 1e-6),
    ],
)
def test_formats(
    name: str, write: Callable[[Path, NDArray[np.float64]], None], unit: float | None, tolerance: float, tmp_path: Path
) -> None:
    depth = METERS.copy()
    depth[0, :3] = 0
    write(tmp_path / name, depth)
    read = read_depth(tmp_path / name)
    values, whole = read.values, read.whole
    assert whole == (unit is not None)
    assert np.isnan(values[0, :3]).all()
    np.testing.assert_allclose(values[1:] / (unit or 1), METERS[1:], atol=tolerance)


def test_bad_depths_become_nan(tmp_path: Path) -> None:
    depth = METERS.copy()
    depth[0, :4] = np.nan, np.inf, -1, 0
    np.save(tmp_path / "d.npy", depth)
    assert np.isnan(read_depth(tmp_path / "d.npy").values).sum() == 4


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("d.npy", np.zeros((9, 9)), "no pixel has a depth"),
        ("d.npy", np.ones((9, 9, 3)), "9 x 9 x 3; a depth map has two axes"),
        ("d.npy", np.ones((2, 9)), "2 x 9; a depth map has two axes"),
        ("d.npy", np.array(["a"]), "an array of <U1; a depth map has numbers"),
        ("d.npy", np.array([{}], object), "not a readable NPY file"),
        ("d.png", b"no picture", "not a readable PNG file"),
        ("d.exr", b"no picture", "not a readable EXR file"),
        ("d.jpg", b"", "unknown format of depth maps"),
        ("d.tif", None, "no such file"),
        ("d.exr", None, "no such file"),
    ],
)
def test_a_bad_depth_map_is_refused(
    name: str, content: NDArray[np.float64] | bytes | None, said: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    if isinstance(content, bytes):
        path.write_bytes(content)
    elif content is not None:
        np.save(path, content)
    with pytest.raises(UserError, match=said) as caught:
        read_depth(path)
    assert str(caught.value).startswith(str(path))


def test_a_color_picture_is_refused(tmp_path: Path) -> None:
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (9, 9, 3), np.uint8)).save(tmp_path / "d.png")
    with pytest.raises(UserError, match="a color picture"):
        read_depth(tmp_path / "d.png")


def test_a_palette_has_no_depths(tmp_path: Path) -> None:
    picture = Image.fromarray(np.arange(81, dtype=np.uint8).reshape(9, 9)).convert("P")
    picture.putpalette(list(range(255, -1, -1)) * 3)
    picture.save(tmp_path / "d.png")
    with pytest.raises(UserError, match="a color picture"):
        read_depth(tmp_path / "d.png")


def test_16_bits_of_three_channels_are_not_cut_to_8(tmp_path: Path) -> None:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = (b"\0" + np.full(27, 1000, ">u2").tobytes()) * 9
    head = struct.pack(">IIBBBBB", 9, 9, 16, 2, 0, 0, 0)
    parts = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    (tmp_path / "d.png").write_bytes(b"\x89PNG\r\n\x1a\n" + parts)
    with pytest.raises(UserError, match="16 bits with colors or opacity"):
        read_depth(tmp_path / "d.png")


@pytest.mark.parametrize(
    ("names", "channel"),
    [
        ("R G B", None),
        ("X Y Z", None),
        ("View.DiffCol.R View.DiffCol.G View.Mist.Z", None),
        ("R G B Z", "Z"),
        ("N.X N.Y N.Z depth.V", "depth.V"),
    ],
)
def test_a_color_or_a_vector_is_no_depth(names: str, channel: str | None, tmp_path: Path) -> None:
    openexr = needs.package("OpenEXR")
    channels = {name: (METERS + k).astype(np.float32) for k, name in enumerate(names.split())}
    header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
    openexr.File(header, channels).write(str(tmp_path / "d.exr"))
    if channel is None:
        with pytest.raises(UserError, match="no depth channel"):
            read_depth(tmp_path / "d.exr")
    else:
        assert read_depth(tmp_path / "d.exr").notes == (f"depths from the channel {channel}",)


def test_a_map_of_few_values_has_a_rounding_step() -> None:
    assert step_of(np.rint(METERS * 100)) == 1
    assert step_of(np.random.default_rng(0).random((128, 128))) == 0


@pytest.mark.parametrize(
    "content",
    [
        {"fx": 50, "fy": 60, "cx": 30, "cy": 20},
        {"fl_x": 100, "fl_y": 120, "cx": 60, "cy": 40, "w": 128, "h": 96},
        {"K": [[50, 0, 30], [0, 60, 20], [0, 0, 1]]},
        {"width": 64, "height": 48, "intrinsic_matrix": [50, 0, 0, 0, 60, 0, 30, 20, 1]},
    ],
)
def test_cameras_from_files(content: object, tmp_path: Path) -> None:
    path = tmp_path / "k.json"
    path.write_text(json.dumps(content))
    assert of_file(path, 48, 64) == Intrinsics(50, 60, 30, 20)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "not JSON"),
        ("[]", "a JSON object"),
        ('{"fx": 1}', "fy is missing"),
        ('{"fx": "a", "fy": 1, "cx": 1, "cy": 1}', "numbers fx, fy, cx, cy"),
        ('{"fx": 0, "fy": 1, "cx": 1, "cy": 1}', "must be above 0"),
        ('{"fx": NaN, "fy": 1, "cx": 1, "cy": 1}', "must be above 0"),
        ('{"K": [[1, 2], [3, 4]]}', "3 x 3 matrix K"),
        ('{"fx": 1, "fy": 1, "cx": 1, "cy": 1, "w": 10, "h": 10}', "the aspects differ"),
    ],
)
def test_a_bad_camera_file_is_refused(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "k.json"
    path.write_text(text)
    with pytest.raises(UserError, match=said) as caught:
        of_file(path, 48, 64)
    assert str(path) in str(caught.value)


def test_a_field_of_view_is_vertical() -> None:
    assert astuple(of_view(90, 48, 64)) == pytest.approx((24, 24, 32, 24))


def test_the_focal_length_comes_from_exif(tmp_path: Path) -> None:
    """For a picture of 36 x 24 pixels, a 35 mm focal length of 26 mm is 26 pixels."""
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA405] = 26
    Image.new("RGB", (36, 24)).save(tmp_path / "p.jpg", exif=exif)
    camera = of_photograph(tmp_path / "p.jpg", 24, 36)
    assert camera is not None
    assert (camera.fx, camera.cx, camera.cy) == pytest.approx((26, 18, 12))
    Image.new("RGB", (36, 24)).save(tmp_path / "q.jpg")
    assert of_photograph(tmp_path / "q.jpg", 24, 36) is None
