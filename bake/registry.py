"""The targets of `mplicits bake`. A new target is one file in codegen/targets and one line here (docs/targets.md)."""

from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from ..codegen.targets.baked import Baked
from ..codegen.targets.uniforms import OPENING_SHADES
from ..model.errors import UserError
from ..model.files import is_special, show

if TYPE_CHECKING:
    from types import ModuleType

    from ..model.model import Model


@dataclass(frozen=True)
class Target:
    """A module that turns a model into the text of one file."""

    module: str
    """The module, below the package. The first call of the target imports it."""
    suffix: str
    """Default ending of the output file's name."""
    page: bool = False
    """Whether the text is a page with a poster, which takes seconds to draw."""
    shaded: bool = False
    """Whether the text has an initial shading mode (--shade)."""
    studio: str = ""
    """The module for --studio, below the package; empty for a target without it."""
    function: bool = False
    """Whether the text is only the distance function: it takes --name and --space."""
    types: str = ""
    """Ending of a second file with the text of the module's function `types`; empty without it."""
    march: bool = False
    """Whether the text can also intersect rays (--with-march)."""

    def baked(
        self,
        model: "Model",
        storage: str = "auto",
        digits: int | None = None,
        name: str | None = None,
        space: str | None = None,
        shade: str | None = None,
        studio: bool = False,
        with_march: bool = False,
    ) -> Baked:
        """Return the text of the output file and what is said of it.

        The module's function `baked` makes it, or `standalone` the text alone.

        storage: "auto", or another storage of the target. digits: decimals of the weights; None for all. name: of the
        function; None for the model's name. space: "model" or "input", the space of the function's points; None for
        model space. shade: initial shading; None for softbox, or for Phong in short texts of Shadertoy. studio:
        whether the page also trains dropped meshes. with_march: whether the text also has NAME_trace. Raises UserError
        where the target does not take the model or an option.
        """
        if shade is not None and not self.shaded:
            raise UserError(f"--shade: only these targets take it: {_names('shaded')}")
        if shade is not None and shade not in OPENING_SHADES:
            raise UserError(f"--shade {show(shade)}: there is {', '.join(OPENING_SHADES)}")
        if studio:
            if not self.studio:
                raise UserError(f"--studio: only these targets take it: {_names('studio')}")
            return replace(self, module=self.studio, studio="").baked(model, storage, digits, name, space, shade)
        if with_march and not self.march:
            raise UserError(f"--with-march: only these targets take it: {_names('march')}")
        if self.function:
            return self._made(
                model,
                storage=storage,
                digits=digits,
                name=name,
                space=space or "model",
                **({"march": True} if with_march else {}),
            )
        for option, value in (("name", name), ("space", space)):
            if value is not None:
                raise UserError(f"--{option}: only these targets take it: {_names('function')}")
        more = {} if shade is None else {"shade": shade}
        return self._made(model, storage=storage, digits=digits, **more)

    def __call__(self, model: "Model", *arguments: Any, **options: Any) -> str:
        """Return the text of the output file. Arguments: see `baked`."""
        return self.baked(model, *arguments, **options).text

    def _made(self, model: "Model", digits: int | None, **options: Any) -> Baked:
        if hasattr(self._module, "baked"):
            return cast(Baked, self._module.baked(model, digits=digits, **options))
        text = self._module.standalone(model, digits=digits, **options)
        if digits is None:
            return Baked(text)
        from ..field.rounding import decimals_line

        return Baked(text, decimals_line(model, digits))

    def beside(self, path: Path) -> dict[Path, str]:
        """Return the further files of an output file: path -> text. There is none beside a pipe."""
        if not self.types or is_special(path):
            return {}
        return {path.with_suffix(self.types): import_module(f"..{self.module}", __package__).types()}

    def size(self, model: "Model") -> int:
        """Return the bytes of the output file. Raises UserError where the target refuses the model.

        For tiny, module and Shadertoy this is an upper bound, since the search for the fewest bits takes seconds.
        """
        return len(getattr(self._module, "exact", self)(model).encode())

    @property
    def _module(self) -> "ModuleType":
        return import_module(f"..{self.module}", __package__)


TARGETS = {
    "glsl330": Target("codegen.targets.glsl330", suffix=".glsl"),
    "glsl300es": Target("codegen.targets.glsl300es", suffix=".es.frag"),
    "html": Target("web.page", suffix=".html", page=True, shaded=True, studio="web.studio_page"),
    "tiny": Target("web.tiny_page", suffix=".tiny.html", shaded=True),
    "module": Target("web.module", suffix=".js", page=True, shaded=True, types=".d.ts"),
    "shadertoy": Target("codegen.targets.shadertoy", suffix=".frag", shaded=True),
    "cuda": Target("codegen.targets.cuda", suffix=".cu"),
    "glsl": Target("codegen.targets.glsl_function", suffix=".sdf.glsl", function=True, march=True),
    "wgsl": Target("codegen.targets.wgsl", suffix=".wgsl", function=True, march=True),
    "hlsl": Target("codegen.targets.hlsl", suffix=".hlsl", function=True, march=True),
    "c": Target("codegen.targets.c", suffix=".c", function=True, march=True),
    "python": Target("codegen.targets.python", suffix=".py", function=True),
}
"""Name for `--target` -> target."""
DEFAULT = "glsl330"
"""Default of --target."""


def _names(kind: str) -> str:
    """Return the names of the targets for which an attribute is true."""
    return ", ".join(name for name, target in TARGETS.items() if getattr(target, kind))
