"""The studio's videos: recorded in Chromium, read by FFmpeg's libraries."""

import base64
import io
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import av
import numpy as np
import pytest

from mplicits.web.bundle import script
from support.page_scripts import BYTES

if TYPE_CHECKING:
    from playwright.sync_api import Browser

RECORD = """async ({width, height, seconds, fps, slowness, stopAt}) => {
    const canvas = document.createElement("canvas"), context = canvas.getContext("2d");
    Object.assign(canvas, {width, height});
    const drawAt = async (share) => {
        await new Promise((resolve) => setTimeout(resolve, slowness));
        const gray = Math.round(220 * share);
        context.fillStyle = `rgb(${gray}, ${gray}, ${gray})`;
        context.fillRect(0, 0, width, height);
    };
    const told = [], tell = (share) => (told.push(share), share >= stopAt ? "stop" : "");
    const video = await recordTurntable(canvas, {seconds, fps, drawAt}, tell);
    return [told, video && textOf(await video.arrayBuffer())];
}"""
MODULES = ("training_error.js", "webm.js", "recorder.js")


Recorded = Callable[..., tuple[list[float], str | None]]


@pytest.fixture
def record(browser: "Browser", tmp_path: Path) -> Recorded:
    """Return a function that records gray frames, as light as their share of the turn, in a page from a file.

    before: JavaScript that runs first.
    """

    def recorded(before: str = "", **options: float) -> tuple[list[float], str | None]:
        file, page = tmp_path / "page.html", browser.new_page()
        file.write_text("<!doctype html><title>A page</title>")
        page.goto(file.as_uri())
        asked = {"width": 96, "height": 64, "seconds": 1, "fps": 20, "slowness": 0, "stopAt": 2} | options
        try:
            page.evaluate(f"{BYTES} {{ {before} {script(MODULES)} window.record = {RECORD}; }} null;")
            told, video = page.evaluate("asked => window.record(asked)", asked)
        finally:
            page.close()
        return told, video

    return recorded


def frames(video: str | None) -> tuple[list[float], list[float], float | None, tuple[int, int], str]:
    """Decode a video: times in seconds, mean gray / 220, the file's duration in seconds or None, size, codec."""
    assert video is not None
    with av.open(io.BytesIO(base64.b64decode(video)), "r") as container:
        stream, duration = container.streams.video[0], container.duration
        shown = [(frame.time, frame.to_ndarray(format="gray").mean() / 220) for frame in container.decode(stream)]
        times, shares = zip(*shown, strict=True)
        codec, size = stream.codec_context.name, (stream.width, stream.height)
    return list(times), list(shares), None if duration is None else duration / 1e6, size, codec


@pytest.mark.parametrize(
    ("codec", "prefix", "size", "off"), [("vp9", "vp09", (96, 64), 0.02), ("vp8", "vp8", (97, 63), 0.1)]
)
def test_a_slowly_drawn_turn_plays_at_the_right_speed(
    record: Recorded, codec: str, prefix: str, size: tuple[int, int], off: float
) -> None:
    """VP8 smooths small changes."""
    supported = "const asked = VideoEncoder.isConfigSupported.bind(VideoEncoder); VideoEncoder.isConfigSupported = "
    supported += f"async (settings) => settings.codec.startsWith({prefix!r}) ? asked(settings) : {{}};"
    told, video = record(supported, slowness=60, seconds=1.5, width=size[0], height=size[1])
    times, shares, duration, found, name = frames(video)
    assert (name, found) == (codec, size)
    assert duration == pytest.approx(1.5)
    assert told == pytest.approx(np.arange(30) / 30)
    np.testing.assert_allclose(times, np.arange(30) / 20, atol=1e-3)
    np.testing.assert_allclose(shares, np.arange(30) / 30, atol=off)


@pytest.mark.slow
def test_players_can_seek(record: Recorded) -> None:
    """Each entry of the file's index leads to a cluster (Matroska's IDs: Segment, CueClusterPosition, Cluster)."""
    _, video = record(seconds=3)
    assert video is not None
    data = base64.b64decode(video)
    segment = data.index(bytes.fromhex("18538067")) + 12
    places = re.findall(b"\\xf1\\x01\\0{6}\\x08(.{8})", data, re.DOTALL)
    clusters = [segment + int.from_bytes(place) for place in places]
    assert [data[at : at + 4].hex() for at in clusters] == 3 * ["1f43b675"]
    with av.open(io.BytesIO(base64.b64decode(video)), "r") as container:
        container.seek(2_200_000)
        frame = next(container.decode(video=0))
        assert frame.time == pytest.approx(2)
        assert frame.to_ndarray(format="gray").mean() / 220 == pytest.approx(2 / 3, abs=0.02)


@pytest.mark.slow
def test_without_an_encoder_the_recording_is_live(record: Recorded) -> None:
    _, video = record("delete globalThis.VideoEncoder;", slowness=50, seconds=1.5)
    times, shares, _, size, _ = frames(video)
    assert size == (96, 64)
    assert len(times) > 3
    assert times[-1] > 1.1
    assert np.polyfit(times, shares, 1)[0] == pytest.approx(1 / 1.5, rel=0.35)


@pytest.mark.parametrize("before", ["", "delete globalThis.VideoEncoder;"])
def test_a_stop_ends_it_without_a_video(record: Recorded, before: str) -> None:
    told, video = record(before, seconds=20, stopAt=0.02)
    assert video is None
    assert all(share < 0.02 for share in told[:-1])
    assert told[-1] >= 0.02


def test_a_browser_without_either_is_told(record: Recorded) -> None:
    with pytest.raises(Exception, match="this browser writes no WebM video"):
        record("delete globalThis.VideoEncoder; delete globalThis.MediaRecorder;")
