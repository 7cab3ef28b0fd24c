"""Output files appear whole or not at all, and a path that cannot be written is refused with one line."""

import errno
import fcntl
import os
import resource
import threading
from pathlib import Path
from typing import NoReturn

import pytest

from mplicits.model import files
from mplicits.model.errors import UserError
from mplicits.model.files import check_writable, regular, show, silent_library, write_whole


def test_an_output_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for bad in (
        tmp_path,
        tmp_path / "no" / "folder",
        tmp_path / "file" / "m",
        tmp_path / ("x" * 300),
        Path("/proc/m"),
        tmp_path / "a\nb" / "m",
    ):
        with pytest.raises(UserError) as caught:
            write_whole(bad, "text")
        assert str(caught.value).startswith(f"cannot write {show(bad)}: ")
        assert str(caught.value).isprintable()
    for bad in (tmp_path, tmp_path / "no" / "folder"):
        with pytest.raises(UserError):
            check_writable(bad)
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]


def test_a_full_disk_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "out.txt"
    path.write_text("before")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (64, hard))
        with pytest.raises(UserError, match="cannot write"):
            write_whole(path, "x" * 1000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(UserError, match="No space left"):
        write_whole(Path("/dev/full"), "text")


def test_only_old_temporary_files_of_killed_processes_are_removed(tmp_path: Path) -> None:
    left, written, fresh = (tmp_path / f"{files.TEMPORARY}{name}" for name in ("left", "written", "fresh"))
    for path in (left, written, fresh):
        path.write_bytes(b"half")
        if path is not fresh:
            os.utime(path, (0, 0))
    with written.open("rb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        write_whole(tmp_path / "m", b"x")
    assert {path.name for path in tmp_path.iterdir()} == {"m", written.name, fresh.name}


def test_a_closed_pipe_is_no_user_error(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    leave = threading.Timer(0.3, lambda: os.close(reader))
    leave.start()
    with pytest.raises(BrokenPipeError):
        write_whole(pipe, bytes(1 << 22))


def test_ctrl_c_while_writing_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> NoReturn:
        raise KeyboardInterrupt

    monkeypatch.setattr("os.replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_whole(tmp_path / "m", b"x")
    assert list(tmp_path.iterdir()) == []


def test_a_link_stays_a_link_and_a_device_stays_a_device(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "folder" / "target")
    write_whole(tmp_path / "link", "text")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "folder" / "target").read_text() == "text"
    write_whole(Path("/dev/null"), "text")
    assert Path("/dev/null").is_char_device()


def test_files_have_the_usual_permissions(tmp_path: Path) -> None:
    (tmp_path / "plain").write_text("")
    write_whole(tmp_path / "ours", "\udcff é")
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "plain").stat().st_mode
    assert (tmp_path / "ours").read_text(encoding="utf-8") == "\\udcff é"


def test_data_reaches_the_disk_before_the_rename_and_the_rename_before_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = []
    fsync, replace = os.fsync, os.replace

    def forced(descriptor: int) -> None:
        place = Path(os.readlink(f"/proc/self/fd/{descriptor}"))
        done.append(f"{'folder' if place.is_dir() else 'file'}, {place.stat().st_size if place.is_file() else 0}")
        fsync(descriptor)

    def renamed(old: Path, new: Path) -> None:
        done.append("renamed")
        replace(old, new)

    monkeypatch.setattr("os.fsync", forced)
    monkeypatch.setattr("os.replace", renamed)
    write_whole(tmp_path / "m", b"12345")
    assert done == ["file, 5", "renamed", "folder, 0"]


@pytest.mark.parametrize(("number", "stays"), [(errno.EIO, True), (errno.ENOSPC, True), (errno.EINVAL, False)])
def test_a_failed_fsync_leaves_the_old_file(
    number: int, stays: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(_: int) -> NoReturn:
        raise OSError(number, os.strerror(number))

    path = tmp_path / "m"
    path.write_text("before")
    monkeypatch.setattr("os.fsync", refused)
    if stays:
        with pytest.raises(UserError, match=os.strerror(number)):
            write_whole(path, "after")
    else:
        write_whole(path, "after")
    assert path.read_text() == ("before" if stays else "after")
    assert list(tmp_path.iterdir()) == [path]


def test_a_pipe_without_a_partner_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "READER", 0.1)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(UserError, match="nobody reads this pipe"):
        write_whole(pipe, b"x")
    for endless in (pipe, Path("/dev/zero")):
        with pytest.raises(OSError, match="a pipe or a device, not a file"):
            regular(endless)
    assert regular(tmp_path) == tmp_path
    received = []
    reader = threading.Timer(0.05, lambda: received.append(pipe.read_bytes()))
    reader.start()
    monkeypatch.setattr(files, "READER", 10.0)
    write_whole(pipe, bytes(1 << 20))
    reader.join()
    assert received == [bytes(1 << 20)]


def test_what_a_library_in_c_prints_is_discarded(capfd: pytest.CaptureFixture[str]) -> None:
    with silent_library():
        os.write(2, b"library: error\n")
    os.write(2, b"ours\n")
    assert capfd.readouterr().err == "ours\n"
