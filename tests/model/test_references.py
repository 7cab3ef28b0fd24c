"""What a file names is a regular file below its folder, or is refused."""

import os
from pathlib import Path

import pytest

from mplicits.model.references import ADDRESS, MISSING, NO_FILE, OUTSIDE, Folder, UnresolvedError


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a file in it, links, a pipe, and a secret beside it."""
    (tmp_path / "secret.bin").write_bytes(b"secret")
    inner = tmp_path / "shape"
    (inner / "images").mkdir(parents=True)
    (inner / "images" / "a b.png").write_bytes(b"image")
    (inner / "out").symlink_to(tmp_path / "secret.bin")
    (inner / "above").symlink_to(tmp_path)
    (inner / "in").symlink_to("images/a b.png")
    (inner / "loop").symlink_to("loop")
    os.mkfifo(inner / "pipe")
    return inner


@pytest.mark.parametrize("name", ["images/a b.png", "images\\a b.png", "./images/../images//a b.png", "in"])
def test_files_below_the_folder_are_found(name: str, folder: Path) -> None:
    assert Folder(folder).file(name).read_bytes() == b"image"


def test_an_absolute_path_below_the_folder_and_a_linked_folder_are_fine(folder: Path, tmp_path: Path) -> None:
    assert Folder(folder).file(folder / "images" / "a b.png").read_bytes() == b"image"
    (tmp_path / "linked").symlink_to(folder)
    assert Folder(tmp_path / "linked").file("in").read_bytes() == b"image"


@pytest.mark.parametrize(
    ("name", "why"),
    [
        *((name, OUTSIDE) for name in ("../secret.bin", "..\\secret.bin", "images/../../secret.bin", "out")),
        *((name, OUTSIDE) for name in ("above/secret.bin", "/etc/passwd", "/proc/self/environ", "/dev/zero", "..")),
        *((name, OUTSIDE) for name in ("C:\\Windows\\win.ini", "c:/x", "\\\\host\\share\\x", "//host/share/x")),
        *((name, ADDRESS) for name in ("http://127.0.0.1:9/x", "FILE:///etc/passwd", "file:secret", "s3://bucket/x")),
        *((name, MISSING) for name in ("", "none.png", "images", "loop", "a\0b", "\ud800", "x" * 300, "x/" * 5000)),
        ("pipe", NO_FILE),
    ],
)
def test_all_else_is_refused_with_the_reason(name: str, why: str, folder: Path) -> None:
    with pytest.raises(UnresolvedError) as refused:
        Folder(folder).file(name)
    assert refused.value.why == why
    assert len(str(refused.value)) < 700
    assert str(refused.value).isprintable()


def test_follow_reads_files_elsewhere_and_still_no_pipes(folder: Path) -> None:
    followed = Folder(folder, follow=True)
    for name in ("../secret.bin", "..\\secret.bin", "out", "above/secret.bin", folder.parent / "secret.bin"):
        assert followed.file(name).read_bytes() == b"secret"
    for name, why in (("pipe", NO_FILE), ("/dev/zero", NO_FILE), ("http://127.0.0.1:9/x", ADDRESS), ("loop", MISSING)):
        with pytest.raises(UnresolvedError) as refused:
            followed.file(name)
        assert refused.value.why == why


def test_find_tells_missing_from_refused(folder: Path) -> None:
    assert Folder(folder).find("none.png") is None
    with pytest.raises(UnresolvedError):
        Folder(folder).find("out")
