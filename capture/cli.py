"""The verb `unproject`, and the list of this room's verbs."""

import sys
from argparse import ArgumentParser, Namespace
from dataclasses import asdict
from inspect import signature
from pathlib import Path

from ..model.errors import UserError
from ..model.verb import Verb, output_arguments
from .photos_cli import PHOTOS

DEFAULT_FOV = 50.0
"""Vertical field of view in degrees of a picture about which nothing is known."""
RELATIVE_RANGE = (1.0, 2.5)
"""Depths of the nearest and the farthest pixel of a relative map: a shape that fills a picture of some 50 degrees."""
DEFAULT_UNIT = 1000.0
"""Whole numbers of a depth map to one unit of length: millimetres, in metres."""
DEFAULT_ESTIMATOR = "depth-anything/Depth-Anything-V2-Small-hf"
"""Name on the Hugging Face hub, from where its weights are downloaded at the first use (Apache 2.0)."""


def unproject_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `unproject` to a parser."""
    add = parser.add_argument
    add(
        "depth",
        type=Path,
        nargs="?",
        metavar="DEPTH",
        help="depth map: PNG of 8 or 16 bits, TIFF, EXR, NPY; 0: nothing",
    )
    output_arguments(parser, "CLOUD.ply", "the point cloud (default: the name of what is read, in this folder)")
    add("--estimate", type=Path, metavar="RGB", help="a photograph in place of a depth map: its depth is estimated")
    add(
        "--estimator",
        metavar="PATH|NAME",
        default=DEFAULT_ESTIMATOR,
        help=f"what estimates: a folder, or a name on the Hugging Face hub (default: {DEFAULT_ESTIMATOR})",
    )
    add("--image", type=Path, metavar="RGB", help="the picture, for colours; what is transparent in it is left out")
    add("--mask", type=Path, metavar="IMAGE", help="white, or opaque, where the shape is; the rest is left out")
    camera = parser.add_mutually_exclusive_group()
    camera.add_argument(
        "--fov",
        type=float,
        metavar="DEG",
        help=f"vertical field of view (default: by the picture's EXIF, or {DEFAULT_FOV:g})",
    )
    camera.add_argument(
        "--intrinsics", type=Path, metavar="K.json", help="the camera: fx, fy, cx, cy in pixels, or a 3 x 3 matrix K"
    )
    add("--relative", action="store_true", help="the map has inverse depths of no unit: larger is nearer")
    add(
        "--range",
        metavar="NEAR,FAR",
        help="depths outside are left out; with --relative, those of the nearest and the farthest pixel "
        f"(default: {RELATIVE_RANGE[0]:g},{RELATIVE_RANGE[1]:g})",
    )
    add(
        "--unit",
        type=float,
        metavar="N",
        default=DEFAULT_UNIT,
        help=f"whole numbers in the map to one unit of length (default: {DEFAULT_UNIT:g}, millimetres to metres)",
    )
    add("--ray", action="store_true", help="depths are along the pixels' rays, not along the camera's axis")
    add("--close", action="store_true", help="add a plausible unseen side: the seen one, mirrored behind the outline")
    add("--json", action="store_true", help="print one JSON object")


def run_unproject(args: Namespace) -> None:
    """Run `mplicits unproject`: write what a depth map shows as a point cloud. Raises UserError."""
    import json

    from ..model.files import check_writable, show, write_whole
    from ..model.kinds import MESH
    from .unprojected import check_cloud_name, unprojected

    source = args.depth or args.estimate
    if source is None:
        raise UserError("name a depth map, or a photograph with --estimate, and not both")
    output = args.output or Path(source.stem + ".ply")
    check_cloud_name(output)
    reads = [path for path in (args.depth, args.estimate, args.image, args.mask, args.intrinsics) if path is not None]
    check_writable(output, reads, kind=MESH, force=args.force)
    taken = signature(unprojected).parameters
    cloud = unprojected(**{name: value for name, value in vars(args).items() if name in taken})
    if cloud.warning:
        print(f"warning: {cloud.warning}", file=sys.stderr)
    write_whole(output, cloud.text())
    if args.json:
        facts = {
            "output": str(output),
            "points": len(cloud.points),
            "colours": cloud.colours is not None,
            "size": list(cloud.size),
            "noise": cloud.noise,
            "cut": asdict(cloud.cut),
        }
        print(json.dumps(facts))
        return
    colours, cut = "with colours" if cloud.colours is not None else "without colours", cloud.cut
    print(f"{show(output)}: {len(cloud.points):,} points with normals, {colours}; noise {cloud.noise:.2%} of the depth")
    print(f"left out: {cut.grazing:,} grazing pixels, {cut.edges:,} at depth edges, {cut.outliers:,} outliers")


VERBS = (
    Verb(
        "unproject",
        "a depth map, or a photograph, becomes a point cloud to train on",
        unproject_arguments,
        "unproject depth.png --image photo.png --fov 50 -o cloud.ply",
        run_unproject,
        "capture",
    ),
    PHOTOS,
)
