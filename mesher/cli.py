"""The verbs `mesh` and `eval`."""

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..model.endings import MESH_NAMES
from ..model.gallery import model_help, model_path
from ..model.options import argument, option
from ..model.surface_figures import FAR
from ..model.verb import Verb, force_option, output_option
from .options import EvalOptions, MeshOptions

if TYPE_CHECKING:
    from ..model.field_figures import FieldFigures
    from .compare import Figures


@dataclass(frozen=True)
class MeshCommand(MeshOptions):
    """Command line of `mesh`."""

    model: Path = argument("M", model_help(), model_path)
    output: Path | None = output_option("OUT", "mesh file: .ply .obj .stl .glb (default: the model's name, .ply)")
    force: bool = force_option()
    json: bool = option(False, "print one JSON object")


def _mesh(command: MeshCommand) -> None:
    """Write the surface of a model as a triangle mesh. Raises UserError."""
    from time import perf_counter

    from ..model.files import check_writable, show, write_whole
    from ..model.kinds import MESH, OWN_MESH
    from ..model.model_file import load
    from .triangle_mesh import make_mesh
    from .write import check_suffix

    output = command.output or Path(command.model.stem + ".ply")
    check_suffix(output)
    check_writable(output, [command.model], kind=MESH if command.output else OWN_MESH, force=command.force)
    model = load(command.model)
    start = perf_counter()
    mesh = make_mesh(model, command)
    seconds = perf_counter() - start
    if warning := mesh.warning(output.suffix.lower()):
        print(f"warning: {warning}", file=sys.stderr)
    write_whole(output, mesh.to_bytes(output.suffix.lower()))
    vertices, faces = len(mesh.vertices), len(mesh.faces)
    if command.json:
        report = {
            "output": str(output),
            "resolution": command.resolution,
            "vertices": vertices,
            "faces": faces,
            "components": mesh.components,
            "spurious": mesh.spurious,
            "specks": mesh.specks,
            "culled": not command.no_cull,
            "seconds": round(seconds, 3),
        }
        print(json.dumps(report))
        return
    print(
        f"{show(output)}: {vertices:,} vertices, {faces:,} faces, {mesh.components} "
        f"component{'s' * (mesh.components != 1)}, {seconds:.1f} s"
    )
    if mesh.spurious:
        fate = "kept (--no-cull)" if command.no_cull else "removed"
        print(f"{mesh.spurious} spurious component{'s' * (mesh.spurious != 1)} outside the bands: {fate}")
    if mesh.specks:
        print(f"{mesh.specks} speck{'s' * (mesh.specks != 1)} at the surface: removed (--keep-specks keeps them)")


@dataclass(frozen=True)
class EvalCommand(EvalOptions):
    """Command line of `eval`."""

    model: Path = argument("M", "model file (.safetensors), a name of the gallery, or a mesh to compare", model_path)
    shape: Path = argument("SHAPE", f"ground truth: a mesh ({MESH_NAMES})")
    json: bool = option(False, "print one JSON object")


def _eval(command: EvalCommand) -> None:
    """Compare a model, or a mesh, with its ground truth. Raises UserError."""
    from dataclasses import asdict

    from ..model.endings import MESHES
    from ..model.files import show
    from ..model.model_file import load
    from .evaluation import evaluate

    path = command.model
    evaluation = evaluate(path if path.suffix.lower() in MESHES else load(path), command.shape, command)
    figures, field, curved = evaluation.figures, evaluation.field, evaluation.curved
    if command.json:
        more = {"field": field, "curved": curved}
        of_model = {name: asdict(part) for name, part in more.items() if part is not None}
        named = {"model": str(path), "shape": str(command.shape)}
        print(json.dumps(named | evaluation.extraction | asdict(figures) | of_model, indent=2))
        return
    print(f"{show(path)} against {show(command.shape)}; lengths in radii of the unit sphere")
    lines = [f"surface                  off by {figures.surface().told()}"]
    if curved is not None and figures.surface().differs(curved):
        lines.append(f"  its curved surface     off by {curved.told()}, says the training, which curved the faces")
    print("\n".join([*lines, *_lines(figures), *_field_lines(field)]))
    if evaluation.warning:
        print(f"warning: {evaluation.warning}")


def _lines(figures: "Figures") -> list[str]:
    """Format the figures as lines of text."""
    ratio = figures.chamfer / figures.floor
    closed = "watertight" if figures.watertight else "not watertight"
    return [
        f"Chamfer, squared L2      {figures.chamfer:.3e}   {ratio:.2f} times the floor, {figures.floor:.3e}",
        f"Hausdorff                {figures.hausdorff:.3e}",
        f"distance to the truth    {figures.distance_mean:.3e} mean, {figures.distance_99:.3e} 99th percentile",
        f"distance of the truth    {figures.missing_mean:.3e} mean, {figures.missing_99:.3e} 99th percentile",
        f"invented surface         {figures.invented:.2%} of the model's, more than {FAR:g} from the truth",
        f"IoU of 0.01 shells       {figures.iou:.4f}",
        f"components               {figures.components}, the truth has {figures.truth_components}; {closed}",
        f"mesh                     {figures.vertices:,} vertices, {figures.faces:,} faces",
        f"{figures.samples:,} samples on each side, seed {figures.seed}",
    ]


def _field_lines(field: "FieldFigures | None") -> list[str]:
    """Format how close the field is to a distance as lines of text; none for a mesh, which has no field."""
    if field is None:
        return []
    from ..model.field_figures import written

    low, middle, high = field.gradient
    error, excess = written(field.domain_error, ".3e"), written(field.domain_excess, ".2%")
    return [
        f"field, in the ball       {error} mean error, too large at {excess}",
        f"field, in the last band  {written(field.band_error, '.3e')} mean error",
        f"|grad f| on the surface  {low:.2f}, {middle:.2f}, {high:.2f}: 10th, 50th and 90th percentile",
    ]


VERBS = (
    Verb("mesh", "a model file becomes a triangle mesh", MeshCommand, "mesh spot -o spot.glb", _mesh, "mesh"),
    Verb(
        "eval",
        "how far a model, or a mesh, is from its ground truth",
        EvalCommand,
        "eval bunny.safetensors bunny.ply",
        _eval,
        "mesh",
    ),
)
