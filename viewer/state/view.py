"""The camera and settings of the window, and how keys and the pointer change them."""

from dataclasses import dataclass, field, replace

from ...codegen.targets.motion import PERIOD, phase_at_time, time_at_phase
from ...codegen.targets.uniforms import SHADING_PICTURES
from ..draw.camera import Camera
from ..draw.options import RenderOptions
from .overlay import MESH_MODES
from .picture import Scene

SHADING_KEYS = {shading.key: shading.name for shading in SHADING_PICTURES}
"""Key -> shading."""
KEYS = (
    ("drag, arrows", "turn"),
    ("right drag, Shift drag", "move"),
    ("wheel, + -", "nearer, farther"),
    ("Space", "turntable; play and pause a motion"),
    ("r", "reset the camera"),
    ("1 to 9", "level"),
    (" ".join(SHADING_KEYS).lower(), ", ".join(shading.label for shading in SHADING_PICTURES)),
    ("b", "split view, all levels on the right"),
    ("m", "the mesh: its edges, its faces"),
    ("s", "save a picture"),
    ("Tab", "panel"),
    ("h", "these keys"),
    ("Esc", "close the help, or quit"),
)
"""(key, effect), as the help and the terminal show them."""
TURNS = {"LEFT": (-15.0, 0.0), "RIGHT": (15.0, 0.0), "UP": (0.0, 10.0), "DOWN": (0.0, -10.0)}
"""Arrow key -> azimuth and elevation by which the camera turns, degrees."""
SLOW_FRAME, FAST_FRAME = 1 / 12, 1 / 50
"""While the camera moves, a frame slower than this reduces the pixels, and a faster one adds some; seconds."""
SCALES = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0)
"""Factors by which the sides of a picture shrink while the camera moves."""
TURNTABLE_SPEED = 30.0
"""Degrees per second."""


@dataclass(slots=True)
class View:
    """The camera, the options of the picture and the state of the panel."""

    home: Camera
    """The camera that the key R restores."""
    options: RenderOptions
    """Of the picture, or of its left half."""
    levels: int
    textured: bool
    """Whether the model has its own colors."""
    moves: bool = False
    """Whether the model depends on the options' time."""
    split: int | None = None
    """Level of the right half; None if the picture is not split."""
    resolution: float = 1.0
    """Pixels per side at rest, as a share of the window's."""
    mesh: str = MESH_MODES[0]
    turntable: bool = False
    """Whether the camera turns by itself."""
    playing: bool = False
    """Whether the model moves by itself."""
    phase: float = 0.0
    """Position in the motion there and back, in [0, 1)."""
    panel: bool = True
    help: bool = False
    """Whether the list of keys is open."""
    changed: bool = True
    """Whether the picture must be drawn again; Drawing resets it."""
    moved: bool = False
    """Whether the camera has moved since the last drawing."""
    coarse: int = len(SCALES) // 2
    """Index into SCALES."""
    camera: Camera = field(init=False)
    """The current camera; `home` at first."""

    def __post_init__(self) -> None:
        self.camera = self.home
        self.phase = phase_at_time(self.options.time)

    @property
    def animated(self) -> bool:
        return self.turntable or self.playing

    @property
    def scale(self) -> float:
        """Factor by which the picture's sides shrink while the camera moves."""
        return SCALES[self.coarse]

    @property
    def right(self) -> RenderOptions | None:
        """The options of the right half; None if the picture is not split."""
        return None if self.split is None else replace(self.options, level=self.split, normal_level=self.split)

    def scene(self, area: tuple[int, int]) -> Scene:
        """Return the scene to draw. area: (width, height) of the picture on the screen, pixels."""
        width, height = (max(1, round(self.resolution * side)) for side in area)
        return Scene((width, height), self.camera, self.options, self.right)

    def resize(self, area: tuple[int, int]) -> None:
        """Adapt to a picture of `area` (width, height) pixels; a camera at the default distance moves."""
        aspect = max(0.01, max(1, area[0]) / max(1, area[1]))  # a thinner window shows only a part of the shape
        self.home, self.camera = replace(self.home, aspect=aspect), replace(self.camera, aspect=aspect)
        self.changed = True

    def fitting(self, levels: int, textured: bool) -> RenderOptions:
        """Return the options; options that do not fit the model's levels and texture become defaults."""
        options = self.options
        level, normal_level = (
            None if number is None or number > levels else number for number in (options.level, options.normal_level)
        )
        shade = "phong" if options.shade == "texture" and not textured else options.shade
        iterations = options.iterations if levels == self.levels else None
        return replace(options, level=level, normal_level=normal_level, shade=shade, iterations=iterations)

    def adapt(self, levels: int, textured: bool, moves: bool) -> None:
        self.options = self.fitting(levels, textured)
        self.moves = moves
        if not moves:
            self.playing = False
            self.seek(0.0)
        self.split = None if self.split is None or self.split > levels else self.split
        self.levels, self.textured, self.changed = levels, textured, True

    def look_from(self, front: tuple[float, float]) -> None:
        """Look at the whole shape from (azimuth, elevation), degrees, and make this the home camera."""
        self.home = replace(self.home, azimuth=front[0], elevation=front[1], distance=None, target=(0.0, 0.0, 0.0))
        self.move(self.home)

    def set(self, **options: object) -> None:
        """Change some of the RenderOptions."""
        self.options, self.changed = replace(self.options, **options), True  # type: ignore[arg-type]

    def change(self, **values: object) -> None:
        """Set attributes of the view, after which the picture must be drawn again."""
        for name, value in values.items():
            setattr(self, name, value)
        self.changed = True

    def move(self, camera: Camera) -> None:
        self.camera, self.changed, self.moved = camera, True, True

    def turn(self, right: float, up: float) -> None:
        """Turn the camera by a drag in window heights: half a turn from edge to edge."""
        self.move(self.camera.orbited(-180.0 * right, -180.0 * up))

    def pan(self, right: float, up: float) -> None:
        """Move the camera by a drag in window heights: the target follows the pointer."""
        height = 2.0 * self.camera.away / self.camera.focal
        self.move(self.camera.panned(-height * right, -height * up))

    def zoom(self, notches: float) -> None:
        """Move nearer by notches of the wheel, or farther if they are negative."""
        self.move(self.camera.zoomed(0.9**notches))

    def spin(self, seconds: float) -> None:
        self.move(self.camera.orbited(TURNTABLE_SPEED * seconds, 0.0))

    def seek(self, time: float) -> None:
        """Show the time, from 0 to 1, of a motion, coarsely while it changes."""
        self.set(time=time)
        self.phase, self.moved = phase_at_time(time), True

    def play(self, seconds: float) -> None:
        self.phase = (self.phase + seconds / PERIOD) % 1.0
        self.set(time=time_at_phase(self.phase))
        self.moved = True

    def key(self, key: str) -> None:
        """Handle a key: a key of SHADING_KEYS or TURNS, a level's digit, R, B, M, H, SPACE, TAB, + or -."""
        if key == "R":
            self.move(self.home)
        elif key in TURNS:
            self.move(self.camera.orbited(*TURNS[key]))
        elif key in "+-":
            self.zoom(1 if key == "+" else -1)
        elif key in SHADING_KEYS and (key != "T" or self.textured):
            self.set(shade=SHADING_KEYS[key])
        elif key.isdecimal() and 1 <= int(key) <= self.levels:
            self.set(level=int(key), normal_level=int(key))
        elif key == "B":
            self.change(split=None if self.split else self.levels)
        elif key == "M":
            self.change(mesh=MESH_MODES[(MESH_MODES.index(self.mesh) + 1) % len(MESH_MODES)])
        elif key == "SPACE" and self.moves:
            self.change(playing=not self.playing)
        elif key == "SPACE":
            self.change(turntable=not self.turntable)
        elif key == "TAB":
            self.change(panel=not self.panel)
        elif key == "H":
            self.help = not self.help

    def timed(self, seconds: float) -> None:
        """Choose the scale of the next frame by the time of the last one."""
        if seconds > SLOW_FRAME:
            target = self.scale * (seconds / SLOW_FRAME) ** 0.5
            self.coarse = next((i for i, scale in enumerate(SCALES) if scale >= target), len(SCALES) - 1)
        elif seconds < FAST_FRAME:
            self.coarse = max(0, self.coarse - 1)
