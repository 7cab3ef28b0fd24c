"""The verb `unproject`, and the list of this room's verbs."""

import sys
from dataclasses import asdict, dataclass
from pathlib import Path

from ..model.options import option
from ..model.verb import Verb, force_option, output_option
from .options import UnprojectOptions
from .photos_cli import PHOTOS


@dataclass(frozen=True)
class UnprojectCommand(UnprojectOptions):
    """Command line of `unproject`."""

    output: Path | None = output_option("CLOUD.ply", "the point cloud (default: the input's name, in this folder)")
    force: bool = force_option()
    json: bool = option(False, "print one JSON object")


def _unproject(command: UnprojectCommand) -> None:
    """Turn a depth map into a point cloud, and write it. Raises UserError."""
    import json

    from ..model.files import check_writable, show, write_whole
    from ..model.kinds import MESH
    from .unprojected import check_cloud_name, unprojected

    files = (command.depth, command.estimate, command.image, command.mask, command.intrinsics)
    reads = [Path(path) for path in files if path is not None]
    output = command.output or Path(reads[0].stem + ".ply")
    check_cloud_name(output)
    check_writable(output, reads, kind=MESH, force=command.force)
    cloud = unprojected(command)
    if cloud.warning:
        print(f"warning: {cloud.warning}", file=sys.stderr)
    write_whole(output, cloud.text())
    if command.json:
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
        UnprojectCommand,
        "unproject depth.png --image photo.png --fov 50 -o cloud.ply",
        _unproject,
        "capture",
    ),
    PHOTOS,
)
