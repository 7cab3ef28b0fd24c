"""The verb `photos`."""

import time
from argparse import ArgumentParser, Namespace
from inspect import signature
from pathlib import Path

from ..model.files import check_writable
from ..model.gallery import SUFFIX
from ..model.interrupts import begin_work, ended_by
from ..model.kinds import MODEL
from ..model.orientation import UPRIGHT
from ..model.verb import Verb, output_arguments, take_negative_numbers
from ..trainer.cli import before_torch
from .photo_settings import BACKGROUNDS, DEFAULT_LEVELS, DEFAULT_STEPS, HELD_OUT, RADIANCE, RAYS, photo_settings


def photos_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `photos` to a parser."""
    add = parser.add_argument
    add(
        "folder",
        type=Path,
        metavar="DIR",
        help="photographs with cameras: image/, mask/ and cameras_sphere.npz (IDR, NeuS), or a transforms.json "
        "(nerfstudio, COLMAP's exports)",
    )
    output_arguments(parser, "M.safetensors", "the model file (default: the folder's name, in this folder)")
    add(
        "--levels",
        metavar="NxD,..",
        help=f"width and hidden layers of each level, coarse to fine (default: {DEFAULT_LEVELS})",
    )
    add("--omega", metavar="W,..", help="omega_0 of each level (default: 15, 30, then 60)")
    add("--radiance", metavar="N", type=int, default=RADIANCE, help=f"width of its network (default: {RADIANCE})")
    add("--rays", metavar="N", type=int, default=RAYS, help=f"rays of a step (default: {RAYS})")
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--seconds", metavar="S", type=float, help="wall time for learning, in place of --steps")
    length.add_argument("--steps", metavar="N", type=int, help=f"optimiser steps (default: {DEFAULT_STEPS:,})")
    add(
        "--held-out",
        metavar="K",
        type=int,
        default=HELD_OUT,
        help=f"every K-th photograph is kept out, and its PSNR is said; 0: none (default: {HELD_OUT})",
    )
    add(
        "--background",
        choices=tuple(BACKGROUNDS),
        default="black",
        help="what is behind the object where there are no masks (default: black)",
    )
    add("--scale", metavar="S", type=float, help="factor on the pictures' sides (default: 4 million pixels in all)")
    add(
        "--camera-size",
        metavar="WxH",
        help="size of the pictures that the cameras of cameras_sphere.npz are for, where these are smaller",
    )
    add(
        "--sphere",
        metavar="X,Y,Z,R",
        help="with a transforms.json: the ball that the object is in (default: what all cameras look at)",
    )
    add(
        "--up",
        choices=UPRIGHT,
        help="axis of the cameras' space that points up (default: as in the pictures)",
    )
    add("--credit", metavar="TEXT", help="author and licence of the photographs")
    add("--seed", metavar="K", type=int, default=0, help="seed of all random numbers (default: 0)")
    add("--resume", action="store_true", help="go on with what was cut short, from NAME.part.safetensors")
    add(
        "--device",
        choices=("auto", "cpu", "cuda"),
        default="auto",
        help="where to learn (default: auto, a CUDA device if there is one)",
    )
    add("--quiet", action="store_true", help="show no progress bar")
    take_negative_numbers(parser)


def run_photos(args: Namespace) -> None:
    """Run `mplicits photos`: write what photographs show as a model. Raises UserError."""
    began = time.perf_counter()
    taken = signature(photo_settings).parameters
    settings = photo_settings(**{name: value for name, value in vars(args).items() if name in taken})
    output = args.output or Path((args.folder.resolve().name or "photographs") + SUFFIX)
    check_writable(output, kind=MODEL, force=args.force)
    before_torch()
    from .photos_session import run

    begin_work()
    run(args.folder, output, settings, resume=args.resume, quiet=args.quiet, began=began)
    if by := ended_by():
        raise SystemExit(128 + by)


PHOTOS = Verb(
    "photos",
    "photographs with known cameras become a model file",
    photos_arguments,
    "photos dtu_scan24 --camera-size 1600x1200",
    run_photos,
)
