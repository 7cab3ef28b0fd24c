"""How the user looks at what is shown, and how keys and the pointer change that."""

from dataclasses import dataclass, field, replace

from ...codegen.targets.motion import PERIOD, phase_at_time, time_at_phase
from ..draw.camera import Camera
from ..draw.options import RenderOptions
from .overlay import MESH_MODES
from .picture import Scene

KEYS = (
    ("drag, arrows", "turn"),
    ("right drag, Shift drag", "move"),
    ("wheel, + -", "nearer, farther"),
    ("Space", "turntable; play and pause a motion"),
    ("r", "reset the camera"),
    ("1 to 9", "level"),
    ("p g n d t x", "Phong, studio, normals, depth, texture, steps"),
    ("b", "split view, all levels on the right"),
    ("m", "the mesh: its edges, its faces"),
    ("s", "save a picture"),
    ("Tab", "panel"),
    ("h", "these keys"),
    ("Esc", "close the help, or quit"),
)
"""(key, what it does), as the help and the terminal show them."""
SHADING_KEYS = {"G": "studio", "N": "normal", "P": "phong", "D": "depth", "T": "texture", "X": "steps"}
"""Key -> shading; `s` saves a picture, so steps have another letter."""
TURNS = {"LEFT": (-15.0, 0.0), "RIGHT": (15.0, 0.0), "UP": (0.0, 10.0), "DOWN": (0.0, -10.0)}
"""Degrees of azimuth and elevation by which an arrow key turns the camera."""
SLOW_FRAME, FAST_FRAME = 1 / 12, 1 / 50
"""Seconds of a frame while the camera moves: after a slower frame fewer pixels are drawn, after a faster one more."""
SCALES = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0)
"""Factors by which the sides of a picture are smaller while the camera moves."""
TURNTABLE_SPEED = 30.0
"""Degrees per second."""


@dataclass
class View:
    """The camera, the options of the picture and the state of the panel; tells what is to be drawn."""

    home: Camera
    """Where the key R takes the camera."""
    options: RenderOptions
    """Options of the picture, or of its left half where it is split."""
    levels: int
    """Number of levels of the model that is shown."""
    textured: bool
    """Whether the model has colours of its own."""
    moves: bool = False
    """Whether the model moves, and the options' time is one of its motion."""
    split: int | None = None
    """Level that the right half shows; None if the picture is not split."""
    resolution: float = 1.0
    """Pixels that are drawn per side, as a share of the window's; while the camera moves, `scale` makes them fewer."""
    mesh: str = MESH_MODES[0]
    """What is shown of the mesh over the model, one of MESH_MODES."""
    turntable: bool = False
    """Whether the camera turns by itself."""
    playing: bool = False
    """Whether the model moves by itself."""
    phase: float = 0.0
    """Share of the motion's way there and back at which the options' time is reached."""
    panel: bool = True
    """Whether the panel is open."""
    help: bool = False
    """Whether the help on the keys is shown."""
    changed: bool = True
    """Whether the picture has to be drawn again; who draws it resets this."""
    moved: bool = False
    """Whether the camera has moved since the picture was last drawn."""
    coarse: int = len(SCALES) // 2
    """Index into SCALES of the factor that the last frames suggest."""
    camera: Camera = field(init=False)
    """Where the user looks from now; `home` at first."""

    def __post_init__(self) -> None:
        self.camera = self.home
        self.phase = phase_at_time(self.options.time)

    @property
    def animated(self) -> bool:
        """Whether something moves by itself."""
        return self.turntable or self.playing

    @property
    def scale(self) -> float:
        """The factor by which the picture's sides are smaller while the camera moves."""
        return SCALES[self.coarse]

    @property
    def right(self) -> RenderOptions | None:
        """The options of the right half; None if the picture is not split."""
        return None if self.split is None else replace(self.options, level=self.split, normal_level=self.split)

    def scene(self, area: tuple[int, int]) -> Scene:
        """Return what is to be drawn. area: (width, height) of the picture on the screen, in pixels."""
        width, height = (max(1, round(self.resolution * side)) for side in area)
        return Scene((width, height), self.camera, self.options, self.right)

    def resize(self, area: tuple[int, int]) -> None:
        """Adapt to a picture of `area` (width, height) pixels; a camera that is to fit the shape fits it again."""
        aspect = max(0.01, max(1, area[0]) / max(1, area[1]))  # A thinner window shows only a part of the shape.
        self.home, self.camera = replace(self.home, aspect=aspect), replace(self.camera, aspect=aspect)
        self.changed = True

    def fitting(self, levels: int, textured: bool) -> RenderOptions:
        """Return the options without those that a model of so many levels, with or without a texture, lacks."""
        options = self.options
        level, normal_level = (
            None if number is None or number > levels else number for number in (options.level, options.normal_level)
        )
        shade = "phong" if options.shade == "texture" and not textured else options.shade
        iterations = options.iterations if levels == self.levels else None
        return replace(options, level=level, normal_level=normal_level, shade=shade, iterations=iterations)

    def adopt(self, levels: int, textured: bool, moves: bool) -> None:
        """Look at another model: what it lacks is no longer asked for."""
        self.options = self.fitting(levels, textured)
        self.moves = moves
        if not moves:
            self.playing = False
            self.seek(0.0)
        self.split = None if self.split is None or self.split > levels else self.split
        self.levels, self.textured, self.changed = levels, textured, True

    def look_from(self, front: tuple[float, float]) -> None:
        """Look at the whole shape from (azimuth, elevation), degrees, and come back there by the key R."""
        self.home = replace(self.home, azimuth=front[0], elevation=front[1], distance=None, target=(0.0, 0.0, 0.0))
        self.move(self.home)

    def set(self, **options: object) -> None:
        """Change some of the RenderOptions."""
        self.options, self.changed = replace(self.options, **options), True  # type: ignore[arg-type]

    def move(self, camera: Camera) -> None:
        """Look through another camera."""
        self.camera, self.changed, self.moved = camera, True, True

    def turn(self, right: float, up: float) -> None:
        """Turn the camera by a drag, given in shares of the window's height: half a turn from edge to edge."""
        self.move(self.camera.orbited(-180.0 * right, -180.0 * up))

    def pan(self, right: float, up: float) -> None:
        """Move the camera by a drag, given in shares of the window's height: the target's plane follows the pointer."""
        height = 2.0 * self.camera.away / self.camera.focal
        self.move(self.camera.panned(-height * right, -height * up))

    def zoom(self, notches: float) -> None:
        """Go nearer by so many notches of the wheel; farther if they are negative."""
        self.move(self.camera.zoomed(0.9**notches))

    def spin(self, seconds: float) -> None:
        """Turn the camera by what the turntable turns in so many seconds."""
        self.move(self.camera.orbited(TURNTABLE_SPEED * seconds, 0.0))

    def seek(self, time: float) -> None:
        """Show a time, from 0 to 1, of the motion; coarse pixels will do while it is looked for."""
        self.set(time=time)
        self.phase, self.moved = phase_at_time(time), True

    def play(self, seconds: float) -> None:
        """Go on with the motion, there and back, by so many seconds."""
        self.phase = (self.phase + seconds / PERIOD) % 1.0
        self.set(time=time_at_phase(self.phase))
        self.moved = True

    def key(self, key: str) -> None:
        """Do what a key does, given its name.

        The name is a shading's letter, a level's digit, R, B, M, H, SPACE, TAB, LEFT, RIGHT, UP, DOWN, + or -; other
        names do nothing.
        """
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
            self.split, self.changed = None if self.split else self.levels, True
        elif key == "M":
            self.mesh, self.changed = MESH_MODES[(MESH_MODES.index(self.mesh) + 1) % len(MESH_MODES)], True
        elif key == "SPACE" and self.moves:
            self.playing, self.changed = not self.playing, True
        elif key == "SPACE":
            self.turntable, self.changed = not self.turntable, True
        elif key == "TAB":
            self.panel, self.changed = not self.panel, True
        elif key == "H":
            self.help = not self.help

    def timed(self, seconds: float) -> None:
        """Choose the pixels of the next frame of a move by the seconds that the last one took."""
        if seconds > SLOW_FRAME:
            target = self.scale * (seconds / SLOW_FRAME) ** 0.5
            self.coarse = next((i for i, scale in enumerate(SCALES) if scale >= target), len(SCALES) - 1)
        elif seconds < FAST_FRAME:
            self.coarse = max(0, self.coarse - 1)


def keys() -> str:
    """Return the help on the keys, one line for each."""
    return "\n".join(f"{key}: {effect}" for key, effect in KEYS)
