"""Seeded inputs that are well formed and mean something absurd: scenes, depth maps, cameras, provenance, logs.

Each function returns the bytes of one case; the function `use_...` of the same name in tests/fuzz/test_hostile.py reads
it.
"""

import base64
import io
import json
import math
import re
from copy import deepcopy
from random import Random
from typing import Any

import numpy as np

NUMBERS = (
    *(0.0, 1.0, -1.0, 0.5, 1e-7, 1e-5, 1e-30, 1e-40, 1e-320),
    *(1e5, 999_999.0, 1e6, 1e7, 1e30, 1e38, 1e39, 1e300, 1e308),
)
"""Numbers at the edges of what is allowed, of float32 and of float64."""
TERMS = ("t", "1e6*t", "1 - t", "min(1e300, t)", "1e30*1e30/1e60*t", "t/1e-40", "t**9", "sin(1e30*t)", "max(t, 1e-39)")
ODD: tuple[Any, ...] = (
    *(None, True, False, 0, 1, -1, 0.5, 2, 10**400, -(10**400), 1e308, 1e-320, "", "x" * 5000, "12", "nan", "1e3"),
    *([], {}, [[]], [None], {"": None}, "\u202e\n\x1b[2J", "<script>", "=1+1"),
)
"""Values of JSON in place of others."""


def deep(depth: int) -> str:
    """Return what `text_of` writes as a list in a list in a list."""
    return f"@{depth}@"


def text_of(value: object) -> str:
    """Write JSON."""
    return re.sub(r'"@(\d+)@"', lambda found: "[" * int(found[1]) + "]" * int(found[1]), json.dumps(value))


def scene(random: Random) -> bytes:
    """A scene of the model part.safetensors: nested groups, placements and grounds at the edges of what is allowed."""

    def number() -> str:
        if random.random() < 0.1:
            return f'"{random.choice(TERMS)}"'
        value = random.choice(NUMBERS) if random.random() < 0.15 else random.uniform(0.1, 2)
        return repr(value if random.random() < 0.95 else -value)

    def placement() -> str:
        lines = []
        for key in ("translate", "axis"):
            if random.random() < 0.3:
                lines.append(f"{key} = [{', '.join(number() for _ in range(3))}]")
        lines += [f"{key} = {number()}" for key in ("angle", "scale") if random.random() < 0.3]
        return "\n".join(lines)

    def group(at: str, depth: int) -> list[str]:
        lines = [f'operation = "{random.choice(("union", "smooth union", "intersection", "difference"))}"']
        lines += [f"radius = {number()}", placement() if at else ""]
        for _ in range(random.choice((1, 1, 2, 3))):
            lines.append(f"[[{at}parts]]")
            if depth and random.random() < 0.6:
                lines += group(f"{at}parts.", depth - 1)
            else:
                lines += ['model = "part.safetensors"', placement()]
        return lines

    text = group("", random.choice((0, 0, 1, 2, 3, 15, 16)))
    if random.random() < 0.4:
        text.append("[ground]")
        text += [f"{key} = {number()}" for key in ("height", "radius", "thickness") if random.random() < 0.5]
    return "\n".join(text).encode()


def depth_map(random: Random) -> bytes:
    """A depth map with options and a camera, as JSON."""
    size = [random.choice((8, 9, 12, 16)) for _ in range(2)]
    if random.random() < 0.1:
        size = [random.choice((1, 2, 8)) for _ in range(random.choice((1, 2, 3)))]
    dtype = random.choice(("f8", "f8", "f4", "f4", "u2", "u1", "i4", "f2", "?"))
    rng = np.random.default_rng(random.getrandbits(32))
    kind = random.choice(("bump", "bump", "bump", "constant", "noise", "line", "one", "mixed"))
    values = 2 + 0.1 * np.hypot.reduce(np.indices(size) - 4.0, axis=0) if kind == "bump" else rng.uniform(0.5, 3, size)
    if kind == "constant":
        values[...] = random.choice(NUMBERS)
    elif kind == "line":
        values[1:] = 0
    elif kind == "one":
        values.ravel()[1:] = 0
    elif kind == "mixed":
        values = rng.choice(NUMBERS, size)
    scale = random.choice((1.0, 1000.0))
    data = io.BytesIO()
    with np.errstate(all="ignore"):
        np.save(data, (values * scale).astype(dtype))
    options: dict[str, Any] = {}
    for key, choices in {
        "relative": (True,),
        "ray": (True,),
        "close": (True,),
        "unit": (1.0, *NUMBERS),
        "fov": (1.0, 40.0, 150.0),
        "range": ([1e307, 1e308], [1e-320, 1e-310], [1.0, 2.0], [1e-300, 1e300]),
    }.items():
        if random.random() < 0.2:
            options[key] = random.choice(choices)
    camera: dict[str, Any] | None = None
    if "fov" not in options and random.random() < 0.5:
        camera = {"fx": 20.0, "fy": 20.0, "cx": 8.0, "cy": 8.0}
        camera |= {key: random.choice((*NUMBERS, 10.0, 8)) for key in camera if random.random() < 0.2}
        if random.random() < 0.3:
            camera |= {"width": random.choice((8, 0, 1e300, 16)), "height": random.choice((8, 0, 1e-300, 16))}
        if random.random() < 0.2:
            camera = {"K": [[random.choice(NUMBERS) for _ in range(3)] for _ in range(random.choice((3, 2)))]}
    case = {"map": base64.b64encode(data.getvalue()).decode(), "options": options, "camera": camera}
    return text_of(case).encode()


def cameras(random: Random) -> bytes:
    """Cameras of five photographs, as JSON: a transforms.json, or matrices of an NPZ; with masks and a ball."""

    def spoiled(matrix: list[list[float]]) -> Any:
        if random.random() < 0.9:
            return matrix
        rows = [list(row) for row in matrix]
        for _ in range(random.randint(1, 3)):
            rows[random.randrange(len(rows))][random.randrange(4)] = random.choice(
                (*NUMBERS, -1e30, math.nan, math.inf)
            )
        if random.random() < 0.2:
            return random.choice((rows[:2], [], [[0] * 4] * 4, "x", None, deep(100)))
        return rows

    poses = []
    for k in range(5):
        angle = 2 * math.pi * k / 5
        c, s = math.cos(angle), math.sin(angle)
        poses.append([[c, 0.0, s, 3 * s], [0.0, 1.0, 0.0, 0.0], [-s, 0.0, c, 3 * c], [0.0, 0.0, 0.0, 1.0]])
    lens: dict[str, Any] = {"camera_angle_x": 0.8}
    if random.random() < 0.5:
        lens = {"fl_x": 20, "fl_y": 20, "cx": 8, "cy": 8, "w": 16, "h": 16}
    for key in list(lens):
        if random.random() < 0.08:
            lens[key] = random.choice((*NUMBERS, *ODD))
    return text_of(
        {
            "layout": random.choice(("transforms", "sphere")),
            "lens": lens,
            "poses": [spoiled(pose) for pose in poses],
            "scale": spoiled(
                [
                    [random.choice((*[1.0] * 30, 1e-300, 1e-12, 1e12, 1e300)) * (i == j) for j in range(4)]
                    for i in range(4)
                ]
            ),
            "masks": [random.choice((0, 128, 255, 255, 255)) for _ in range(random.choice((0, 5, 5, 4)))],
            "sphere": random.choice((None, None, [0, 0, 0, 1], [1e6, 0, 0, 1], [0, 0, 0, 1e-9], [0, 0, 0, 1e11])),
        }
    ).encode()


def provenance(random: Random) -> bytes:
    """A provenance of a training, some of it replaced, as JSON."""
    record: dict[str, Any] = {"network": "4x1", "omega": 30.0, "steps": 20, "fraction": 1.0, "restarts": 0}
    record |= {"rate": 1e-3, "loss": 0.5, "seconds": 1.5, "mean_f": 1e-3, "angle": 5.0}
    whole: dict[str, Any] = {
        "source": {"file": "x.ply", "sha256": "0" * 64, "noise": None},
        "seed": 0,
        "settings": {"networks": [[4, 1], [4, 0]], "omegas": [30.0, 30.0], "seconds": None},
        "seconds": 3.0,
        "interrupted": True,
        "levels": [dict(record), dict(record) | {"network": "4x0"}],
        "field": {"domain_error": 1e-3, "band_error": 1e-3, "domain_excess": 0.1, "gradient": [0.9, 1.0, 1.1]},
        "texture": dict(record),
        "versions": {"torch": "2", "numpy": "2"},
    }
    for _ in range(random.randint(1, 3)):
        _replace(whole, random)
    return text_of(whole).encode()


def log(random: Random) -> bytes:
    """A log of a training, some of it replaced."""
    lines = []
    for step in range(10, 100, 10):
        line: dict[str, Any] = {"level": 1, "network": "8x0", "step": step}
        line |= {"fraction": 0.1, "loss": 0.5, "mean_f": 0.01}
        if random.random() < 0.2:
            _replace(line, random)
        lines.append(text_of(line))
    return "\n".join(lines).encode()


def _replace(value: Any, random: Random) -> None:
    """Replace one value somewhere inside a dict or a list."""
    keys = list(value) if isinstance(value, dict) else list(range(len(value)))
    key = random.choice(keys)
    if isinstance(value[key], (dict, list)) and value[key] and random.random() < 0.7:
        _replace(value[key], random)
    elif isinstance(value, dict) and random.random() < 0.15:
        del value[key]
    else:
        value[key] = deep(random.choice((70, 900, 10_000))) if random.random() < 0.1 else deepcopy(random.choice(ODD))
