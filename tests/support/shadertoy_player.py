"""Another Shadertoy player: wgpu-shadertoy, on Vulkan."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from support import needs

_SCRIPT = """
import sys
from wgpu_shadertoy import Shadertoy
from PIL import Image
text, size, output = open(sys.argv[1]).read(), tuple(map(int, sys.argv[2].split("x"))), sys.argv[3]
drawn = Shadertoy(text, resolution=size).snapshot(float(sys.argv[4]))
Image.frombytes("RGBA", size, bytes(drawn)).convert("RGB").save(output)
"""


def player_picture(text: str, size: tuple[int, int], folder: Path, time: float = 0.0) -> NDArray[np.int16]:
    """Return a player's picture, (H, W, 3), from 0 to 255. Skips the test where it is not installed.

    folder: for files. time: iTime.
    """
    needs.package("wgpu_shadertoy")
    (folder / "text.frag").write_text(text)
    player = subprocess.run(
        [sys.executable, "-c", _SCRIPT, "text.frag", "x".join(map(str, size)), "player.png", str(time)],
        cwd=folder,
        env={**os.environ, "WGPU_FORCE_OFFSCREEN": "true"},
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    if "adapter" in player.stderr.lower() and player.returncode:
        needs.lack("a driver of Vulkan")
    assert player.returncode == 0, player.stderr
    return np.asarray(Image.open(folder / "player.png"), np.int16)
