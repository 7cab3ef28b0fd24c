"""A mesh or an oriented point cloud becomes a small multiscale neural signed distance function, baked into shaders.

    import mplicits

    m = mplicits.load("spot")                   # a name of the gallery, a path, or the bytes of a model file
    m([[0, 0, 0], [0, 2, 0]])                   # signed distances, negative inside
    m.render(size=512)                          # a picture, (512, 512, 3) uint8
    mplicits.train("bunny.ply", seconds=60).save("bunny.safetensors")

docs/python.md has more, ARCHITECTURE.md has a map of the rooms. Modules load when they are first used.
"""

from importlib import import_module

TYPE_CHECKING = False  # `typing` would load before Ctrl-C is handled.

if TYPE_CHECKING:
    from .api.field import Field as Field
    from .api.functions import check as check
    from .api.functions import compose as compose
    from .api.functions import evaluate as evaluate
    from .api.functions import import_checkpoints as import_checkpoints
    from .api.functions import load as load
    from .api.functions import morph as morph
    from .api.functions import photos as photos
    from .api.functions import report as report
    from .api.functions import train as train
    from .api.functions import unproject as unproject
    from .capture.unprojection import Unprojected as Unprojected
    from .field.hits import Hits as Hits
    from .mesher.evaluation import Evaluation as Evaluation
    from .mesher.triangle_mesh import TriangleMesh as TriangleMesh
    from .model.errors import UserError as UserError
    from .trainer.check import Checked as Checked

_PLACES = {
    "Checked": "trainer.check",
    "Evaluation": "mesher.evaluation",
    "Field": "api.field",
    "Hits": "field.hits",
    "TriangleMesh": "mesher.triangle_mesh",
    "Unprojected": "capture.unprojection",
    "UserError": "model.errors",
    **dict.fromkeys(
        (
            "check",
            "compose",
            "evaluate",
            "import_checkpoints",
            "load",
            "morph",
            "photos",
            "report",
            "train",
            "unproject",
        ),
        "api.functions",
    ),
}
"""Name -> its module, which the first use imports."""
__all__ = sorted(_PLACES)  # noqa: PLE0605 (the imports above are for type checkers)


def __getattr__(name: str) -> object:
    """Import a public name (PEP 562)."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = getattr(import_module(f".{_PLACES[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List all public names."""
    return sorted({*globals(), *_PLACES})
