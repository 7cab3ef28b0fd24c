"""What the window shows, and what keys and the pointer make of it."""

from dataclasses import dataclass, field, replace

from ..draw.camera import Camera
from ..draw.options import RenderOptions
from .overlay import SHOWN
from .picture import Scene

KEYS = (
    ("drag, arrows", "turn"),
    ("right drag, Shift drag", "move"),
    ("wheel, + -", "nearer, farther"),
    ("Space", "turntable"),
    ("r", "reset the camera"),
    ("1 to 9", "level"),
    ("p n d t x", "Phong, normals, depth, texture, steps"),
    ("b", "split view, all levels on the right"),
    ("m", "the mesh: its edges, its faces"),
    ("s", "save a picture"),
    ("Tab", "panel"),
    ("h", "these keys"),
    ("Esc", "quit"),
)
SHADING_KEYS = {"N": "normal", "P": "phong", "D": "depth", "T": "texture", "X": "steps"}
TURNS = {"LEFT": (-15.0, 0.0), "RIGHT": (15.0, 0.0), "UP": (0.0, 10.0), "DOWN": (0.0, -10.0)}
"""Degrees of azimuth and elevation."""
SLOW, FAST = 1 / 12, 1 / 50
"""Seconds of a frame while the camera moves: beyond SLOW fewer pixels are drawn, below FAST more."""
SCALES = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0)
"""Factors by which a moving picture's sides may be smaller."""
TURNTABLE = 30.0
"""Degrees per second."""


@dataclass
class View:
    """levels, textured: of the model. split: level shown on the right half. resolution: pixels drawn per side, as a
    share of the window's. mesh: what is shown of one, one of SHOWN.
    changed: something else is to be drawn; moved: by the camera.
    """

    home: Camera
    options: RenderOptions
    levels: int
    textured: bool
    split: int | None = None
    resolution: float = 1.0
    mesh: str = SHOWN[0]
    turntable: bool = False
    panel: bool = True
    help: bool = False
    changed: bool = True
    moved: bool = False
    coarse: int = len(SCALES) // 2
    camera: Camera = field(init=False)

    def __post_init__(self) -> None:
        self.camera = self.home

    @property
    def scale(self) -> float:
        """Factor by which the sides of a moving picture are smaller."""
        return SCALES[self.coarse]

    @property
    def right(self) -> RenderOptions | None:
        """Options of the right half, where the view is split."""
        return None if self.split is None else replace(self.options, level=self.split, normal_level=self.split)

    def scene(self, area: tuple[int, int]) -> Scene:
        """What is to be drawn onto so many pixels of the window."""
        width, height = (max(1, round(self.resolution * side)) for side in area)
        return Scene((width, height), self.camera, self.options, self.right)

    def resize(self, area: tuple[int, int]) -> None:
        """The window's picture has a new size: a camera that is to fit the shape fits it again."""
        aspect = max(0.01, max(1, area[0]) / max(1, area[1]))  # thinner windows show a part of the shape
        self.home, self.camera = replace(self.home, aspect=aspect), replace(self.camera, aspect=aspect)
        self.changed = True

    def fitting(self, levels: int, textured: bool) -> RenderOptions:
        """The options without what a model of so many levels lacks."""
        options = self.options
        level, normal_level = (
            None if wanted is None or wanted > levels else wanted for wanted in (options.level, options.normal_level)
        )
        shading = "phong" if options.shading == "texture" and not textured else options.shading
        iterations = options.iterations if levels == self.levels else None
        return replace(options, level=level, normal_level=normal_level, shading=shading, iterations=iterations)

    def adopt(self, levels: int, textured: bool) -> None:
        """Another model: what it lacks is no longer asked for."""
        self.options = self.fitting(levels, textured)
        self.split = None if self.split is None or self.split > levels else self.split
        self.levels, self.textured, self.changed = levels, textured, True

    def set(self, **options: object) -> None:
        """Changes options of the picture."""
        self.options, self.changed = replace(self.options, **options), True  # type: ignore[arg-type]

    def move(self, camera: Camera) -> None:
        """Takes a new camera."""
        self.camera, self.changed, self.moved = camera, True, True

    def turn(self, right: float, up: float) -> None:
        """A drag, as shares of the window's height: half a turn from edge to edge."""
        self.move(self.camera.orbited(-180.0 * right, -180.0 * up))

    def pan(self, right: float, up: float) -> None:
        """A drag, as shares of the window's height: the target's plane follows the pointer."""
        height = 2.0 * self.camera.away / self.camera.focal
        self.move(self.camera.panned(-height * right, -height * up))

    def zoom(self, notches: float) -> None:
        """A wheel's notches; up is nearer."""
        self.move(self.camera.zoomed(0.9**notches))

    def spin(self, seconds: float) -> None:
        """The turntable goes on."""
        self.move(self.camera.orbited(TURNTABLE * seconds, 0.0))

    def key(self, key: str) -> None:
        """A key by its name: a shading's letter, a level's digit, R, B, M, H, SPACE, TAB, an arrow, + or -."""
        if key == "R":
            self.move(self.home)
        elif key in TURNS:
            self.move(self.camera.orbited(*TURNS[key]))
        elif key in "+-":
            self.zoom(1 if key == "+" else -1)
        elif key in SHADING_KEYS and (key != "T" or self.textured):
            self.set(shading=SHADING_KEYS[key])
        elif key.isdecimal() and 1 <= int(key) <= self.levels:
            self.set(level=int(key), normal_level=int(key))
        elif key == "B":
            self.split, self.changed = None if self.split else self.levels, True
        elif key == "M":
            self.mesh, self.changed = SHOWN[(SHOWN.index(self.mesh) + 1) % len(SHOWN)], True
        elif key == "SPACE":
            self.turntable, self.changed = not self.turntable, True
        elif key == "TAB":
            self.panel, self.changed = not self.panel, True
        elif key == "H":
            self.help = not self.help

    def timed(self, seconds: float) -> None:
        """Adapts the pixels of a moving frame to what the last one took."""
        if seconds > SLOW:
            wanted = self.scale * (seconds / SLOW) ** 0.5
            self.coarse = next((i for i, scale in enumerate(SCALES) if scale >= wanted), len(SCALES) - 1)
        elif seconds < FAST:
            self.coarse = max(0, self.coarse - 1)


def keys() -> str:
    """The keys, a line each."""
    return "\n".join(f"{key}: {what}" for key, what in KEYS)
