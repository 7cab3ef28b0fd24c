"""The verb `mesh`, and the list of this room's verbs; `eval` is in eval_cli.py."""

from dataclasses import dataclass
from pathlib import Path

from ..model.gallery import model_help, model_path
from ..model.options import argument, option
from ..model.verb import Verb, force_option, output_option
from .eval_cli import EVAL
from .options import MeshOptions


@dataclass(frozen=True)
class MeshCommand(MeshOptions):
    """Command line of `mesh`."""

    model: Path = argument("M", model_help(), model_path)
    output: Path | None = output_option("OUT", "mesh file: .ply .obj .stl .glb (default: the model's name, .ply)")
    force: bool = force_option()
    json: bool = option(False, "print one JSON object")


def _mesh(command: MeshCommand) -> None:
    """Write the surface of a model as a triangle mesh. Raises UserError."""
    import json
    from time import perf_counter

    from ..model.files import check_writable, show, write_whole
    from ..model.kinds import MESH
    from ..model.model_file import load
    from .triangle_mesh import make_mesh
    from .write import check_suffix

    output = command.output or Path(command.model.stem + ".ply")
    check_suffix(output)
    check_writable(output, [command.model], kind=MESH, force=command.force)
    model = load(command.model)
    start = perf_counter()
    mesh = make_mesh(model, command)
    seconds = perf_counter() - start
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


VERBS = (
    Verb("mesh", "a model file becomes a triangle mesh", MeshCommand, "mesh spot -o spot.glb", _mesh, "mesh"),
    EVAL,
)
