"""A mesh or an oriented point cloud becomes a small multiscale neural signed distance function, baked into shaders.

    import mplicits

    m = mplicits.load("spot")                   # a name of the gallery, a path, or the bytes of a model file
    m([[0, 0, 0], [0, 2, 0]])                   # signed distances, negative inside
    m.render(size=512)                          # a picture, (512, 512, 3) uint8
    mplicits.train("bunny.ply", seconds=60).save("bunny.safetensors")

docs/python.md tells the rest. Nothing is loaded before it is used. The rooms are `model` (the model file), `glsl`
(shaders written by hand), `codegen` (from a model to shader source), `trainer` (from a shape to a model), `scenes`
(models placed and joined), `mesher` (from a model to a mesh) and `viewer` (from a model to a picture or a window);
`cli` is the command line.
"""

from importlib import import_module

TYPE_CHECKING = False  # As of `typing`, which takes longer to load than all else up to where Ctrl-C is seen to.

if TYPE_CHECKING:
    from .api.field import Field as Field
    from .api.functions import compose as compose
    from .api.functions import evaluate as evaluate
    from .api.functions import import_checkpoints as import_checkpoints
    from .api.functions import load as load
    from .api.functions import morph as morph
    from .api.functions import photos as photos
    from .api.functions import report as report
    from .api.functions import train as train
    from .api.functions import unproject as unproject
    from .capture.unprojected import Unprojected as Unprojected
    from .field.hits import Hits as Hits
    from .mesher.evaluation import Evaluation as Evaluation
    from .mesher.triangle_mesh import TriangleMesh as TriangleMesh
    from .model.errors import UserError as UserError

_PLACES = {
    "Evaluation": "mesher.evaluation",
    "Field": "api.field",
    "Hits": "field.hits",
    "TriangleMesh": "mesher.triangle_mesh",
    "Unprojected": "capture.unprojected",
    "UserError": "model.errors",
    "compose": "api.functions",
    "evaluate": "api.functions",
    "import_checkpoints": "api.functions",
    "load": "api.functions",
    "morph": "api.functions",
    "photos": "api.functions",
    "report": "api.functions",
    "train": "api.functions",
    "unproject": "api.functions",
}
"""Name -> the module that it is in, which is loaded when somebody asks for the name."""

__all__ = [
    "Evaluation",
    "Field",
    "Hits",
    "TriangleMesh",
    "Unprojected",
    "UserError",
    "compose",
    "evaluate",
    "import_checkpoints",
    "load",
    "morph",
    "photos",
    "report",
    "train",
    "unproject",
]


def __getattr__(name: str) -> object:
    """Load what is asked for (PEP 562)."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = getattr(import_module(f".{_PLACES[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List what there is, loaded or not."""
    return sorted({*globals(), *_PLACES})
