"""The verbs `unproject` and `photos`."""

import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

from ..model.files import check_writable, show, write_whole
from ..model.gallery import SUFFIX
from ..model.interrupts import begin_work, ended_by
from ..model.kinds import MESH, MODEL, OWN_MESH
from ..model.options import argument, option
from ..model.verb import Verb, force_option, output_option
from ..trainer.openmp import prepare_openmp
from .options import PhotoOptions, UnprojectOptions


@dataclass(frozen=True)
class UnprojectCommand(UnprojectOptions):
    """Command line of `unproject`."""

    output: Path | None = output_option("CLOUD.ply", "point cloud (default: the input's name, .ply)")
    force: bool = force_option()
    json: bool = option(False, "print one JSON object")


def _unproject(command: UnprojectCommand) -> None:
    """Write a depth map as a point cloud. Raises UserError."""
    import json

    from .cloud import check_name
    from .unprojection import unprojected

    output = command.output or Path(command.inputs()[0].stem + ".ply")
    check_name(output)
    kind = MESH if command.output else OWN_MESH
    check_writable(output, command.inputs(), kind=kind, force=command.force)
    cloud = unprojected(command)
    if cloud.warning:
        print(f"warning: {cloud.warning}", file=sys.stderr)
    for note in cloud.notes:
        print(note, file=sys.stderr)
    write_whole(output, cloud.to_ply())
    colored, cut = cloud.colors is not None, cloud.cut
    if command.json:
        facts = {
            "output": str(output),
            "points": len(cloud.points),
            "colors": colored,
            "size": list(cloud.size),
            "noise": cloud.noise,
            "cut": asdict(cut),
            "notes": list(cloud.notes),
        }
        print(json.dumps(facts))
        return
    colors = "with colors" if colored else "without colors"
    print(f"{show(output)}: {len(cloud.points):,} points with normals, {colors}; noise {cloud.noise:.2%} of the depth")
    print(f"left out: {cut.grazing:,} grazing pixels, {cut.edges:,} at depth edges, {cut.outliers:,} outliers")


@dataclass(frozen=True)
class PhotosCommand(PhotoOptions):
    """Command line of `photos`."""

    folder: Path = argument(
        "DIR",
        "photographs with cameras: image/, mask/ and cameras_sphere.npz (IDR, NeuS), a transforms.json (nerfstudio, "
        "NeuS2) or transforms_train.json (NeRF), or images/ and sparse/0 (COLMAP)",
        Path,
    )
    output: Path | None = output_option("M.safetensors", "model file (default: the folder's name)")
    force: bool = force_option()
    resume: bool = option(False, "continue an interrupted run from NAME.part.safetensors")


def _photos(command: PhotosCommand) -> None:
    """Reconstruct photographs as a model file. Raises UserError."""
    began = time.perf_counter()
    output = command.output or Path((command.folder.resolve().name or "photographs") + SUFFIX)
    reads = [path for path in command.folder.rglob("*") if path.suffix != SUFFIX]
    check_writable(output, reads, kind=MODEL, force=command.force)
    prepare_openmp()
    from .session import run

    begin_work()
    run(command.folder, output, command, resume=command.resume, began=began)
    if by := ended_by():
        raise SystemExit(128 + by)


VERBS = (
    Verb(
        "unproject",
        "a depth map, or a photograph, becomes a point cloud to train on",
        UnprojectCommand,
        "unproject depth.png --image photo.png --fov 50 -o cloud.ply",
        _unproject,
        "capture",
    ),
    Verb(
        "photos",
        "photographs with known cameras become a model file",
        PhotosCommand,
        "photos dtu_scan24 --camera-size 1600x1200",
        _photos,
    ),
)
