"""What `mplicits render --frames` does: a video of a model that moves, or of a turn around one that does not."""

from argparse import Namespace
from pathlib import Path

from tqdm import tqdm

from ..model.errors import UserError
from ..model.files import write_whole
from .draw.camera import Camera
from .draw.movie import MOST_FRAMES, RATES, Shot, open_movie
from .draw.options import RenderOptions
from .draw.renderer import Renderer
from .draw.tiles import tiles

RATE = 30
"""Pictures a second, where --fps does not say so."""


def check_options(args: Namespace) -> None:
    """Raise UserError where options of videos and of pictures do not go together, or their numbers are out of range."""
    of_videos = {"--fps": args.fps is not None, "--once": args.once, "--turn": args.turn is not None}
    of_pictures = {"--benchmark": args.benchmark is not None, "--transparent": args.transparent}
    if args.frames is None:
        given = [name for name, is_given in of_videos.items() if is_given]
        if given:
            raise UserError(f"{', '.join(given)}: of a video; it needs --frames N, the number of its pictures")
        return
    given = [name for name, is_given in of_pictures.items() if is_given]
    if given:
        raise UserError(f"{', '.join(given)}: of a single picture; leave out --frames")
    if not 1 <= args.frames <= MOST_FRAMES:
        raise UserError(f"--frames {args.frames}: a whole number from 1 to {MOST_FRAMES}")
    if args.fps is not None and not RATES[0] <= args.fps <= RATES[1]:
        raise UserError(f"--fps {args.fps}: a whole number from {RATES[0]} to {RATES[1]}")
    if args.turn is not None and not abs(args.turn) <= 1e6:
        raise UserError(f"--turn {args.turn:g}: degrees, at most a million")


def shot_from(args: Namespace, moving: bool) -> Shot | None:
    """Return what the video shows that --frames asks for; None where it asks for none. moving: whether the model moves.

    Raises UserError where the options do not fit the model.
    """
    if args.frames is None:
        return None
    if args.once and not moving:
        raise UserError("--once: of a motion; this model does not move")
    if args.time is not None:
        raise UserError("--time: one moment; --frames shows all of them")
    if args.mesh is not None and moving:
        raise UserError("--mesh: it does not move as the model does; leave out --frames, and choose its --time")
    turn = args.turn if args.turn is not None else 0.0 if moving else 360.0
    return Shot(args.frames, args.fps or RATE, turn, moving, args.once)


def record(
    renderer: Renderer, path: Path, size: tuple[int, int], shot: Shot, camera: Camera, options: RenderOptions
) -> float:
    """Draw a video and write its file, whole or not at all; on a terminal, a progress bar shows where it takes long.

    size: (width, height) in pixels. camera, options: of the first picture. Returns the share of all pixels' samples
    that hit the shape. Raises UserError where the driver fails or the file cannot be written.
    """
    covered, total = 0.0, shot.frames * len(list(tiles(size))) * options.samples
    with (
        open_movie(path, size, shot.rate) as movie,
        tqdm(total=total, desc="render", delay=2, leave=False, disable=None) as bar,
    ):
        for k in range(shot.frames):
            seen_from, shown = shot.frame(k, camera, options)
            image = renderer.render_tiles(size, seen_from, shown, bar.update)
            movie.add(image)
            covered += float(image[..., 3].mean()) / shot.frames
        write_whole(path, movie.data())
    return covered
