"""Images that take far more than their size, or that make a library print."""

import io
import struct
from pathlib import Path

import pytest
from PIL import Image

from mplicits.model.errors import UserError
from mplicits.model.image_file import MOST_SCANS, open_image
from support.growing_files import png


def segment(marker: int, data: bytes) -> bytes:
    return bytes([0xFF, marker]) + struct.pack(">H", len(data) + 2) + data


def gray_jpeg(scans: int) -> bytes:
    """Return a progressive JPEG of 16 x 16 gray pixels, each of whose scans changes nothing."""
    tables = segment(0xDB, b"\0" + b"\1" * 64) + segment(0xC4, b"\x10\1" + b"\0" * 15 + b"\x20")
    frame = segment(0xC2, struct.pack(">BHHB", 8, 16, 16, 1) + b"\1\x11\0")
    scan = segment(0xDA, b"\1\1\0\1\x3f\0") + b"\x1f"
    return b"\xff\xd8" + segment(0xE1, b"\xff\xda" * 100) + tables + frame + scan * scans + b"\xff\xd9"


def test_a_jpeg_of_many_scans_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.jpg"
    path.write_bytes(gray_jpeg(MOST_SCANS) + b"\xff\xda" * 1000)  # after the end: of no picture
    assert open_image(path, "--texture").size == (16, 16)
    path.write_bytes(gray_jpeg(MOST_SCANS + 1))
    with pytest.raises(UserError, match="not a readable image"):
        open_image(path, "--texture")


@pytest.mark.parametrize("progressive", [False, True])
def test_a_common_jpeg_is_read(progressive: bool, tmp_path: Path) -> None:
    picture = Image.effect_noise((64, 64), 90).convert("RGB")
    picture.save(tmp_path / "a.jpg", progressive=progressive)
    assert open_image(tmp_path / "a.jpg", "--texture").size == (64, 64)


def test_no_icon_is_decoded_before_its_size_is_known(tmp_path: Path) -> None:
    data = png(64)
    entry = struct.pack("<BBBBHHII", 16, 16, 0, 0, 1, 32, len(data), 22)
    (tmp_path / "a.png").write_bytes(struct.pack("<HHH", 0, 1, 1) + entry + data)
    with pytest.raises(UserError, match="not a readable image"):
        open_image(tmp_path / "a.png", "--texture")


def test_what_libtiff_prints_is_not_shown(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    data = io.BytesIO()
    Image.new("L", (64, 64)).save(data, "TIFF", compression="tiff_deflate")
    (tmp_path / "a.tif").write_bytes(data.getvalue().replace(b"x\x9c", b"x\x9d"))
    with pytest.raises(UserError, match="not a readable image"):
        open_image(tmp_path / "a.tif", "--texture")
    assert capfd.readouterr().err == ""
