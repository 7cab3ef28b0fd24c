"""The targets of `mplicits bake`: a new one is one file in codegen/targets and one line here (docs/targets.md)."""

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, cast

from ..codegen.targets.uniforms import OPENING_SHADES
from ..model.errors import UserError
from ..model.files import show

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..model.model import Model


@dataclass(frozen=True)
class Target:
    """A module that turns a model into the text of one file."""

    module: str
    """The module, below the package. The first call of the target imports it."""
    suffix: str
    """How the output file's name ends where the user gives none."""
    page: bool = False
    """Whether the text is a page: it holds a small picture, which takes seconds to draw."""
    opens: bool = False
    """Whether the text opens in a shading."""
    alone: bool = False
    """Whether the text is a function alone, for another program: it takes a name and a space."""

    def __call__(
        self,
        model: "Model",
        storage: str = "auto",
        digits: int | None = None,
        name: str | None = None,
        space: str | None = None,
        shade: str | None = None,
    ) -> str:
        """Return the text of the whole output file, by the module's function `standalone`.

        storage: how weights are stored: "auto", or a way that the target has. digits: decimals that the weights are
        rounded to, None for all. name: of a function alone; None: made of the model's. space: "model" or "input", where
        a function alone takes points; None: model space. shade: shading that the text opens in; None: the studio, but
        for short texts of Shadertoy. Raises UserError where the target does not take the model, the storage, a name, a
        space or a shading.
        """
        if shade is not None and not self.opens:
            opening = ", ".join(key for key, target in TARGETS.items() if target.opens)
            raise UserError(f"--shade: only these open in one: {opening}")
        if shade is not None and shade not in OPENING_SHADES:
            raise UserError(f"--shade {show(shade)}: there is {', '.join(OPENING_SHADES)}")
        if self.alone:
            return self._standalone(model, storage=storage, digits=digits, name=name, space=space or "model")
        for option, value in (("name", name), ("space", space)):
            if value is not None:
                targets = ", ".join(key for key, target in TARGETS.items() if target.alone)
                raise UserError(f"--{option}: only functions alone have one: {targets}")
        more = {} if shade is None else {"shade": shade}
        return self._standalone(model, storage=storage, digits=digits, **more)

    def size(self, model: "Model") -> int:
        """Count the bytes of the output file, without the poster where it has one. Raises UserError likewise.

        For Shadertoy they are the most that it can be: the search for the fewest bits takes seconds.
        """
        if self.module.endswith(".shadertoy"):
            from ..codegen.targets.shadertoy import exact

            return len(exact(model).encode())
        return len(self._standalone(model, **({"poster": False} if self.page else {})).encode())

    @property
    def _standalone(self) -> "Callable[..., str]":
        """The module's function."""
        return cast("Callable[..., str]", import_module(f"..{self.module}", __package__).standalone)


TARGETS = {
    "glsl330": Target("codegen.targets.glsl330", suffix=".glsl"),
    "glsl300es": Target("codegen.targets.glsl300es", suffix=".es.frag"),
    "html": Target("web.page", suffix=".html", page=True, opens=True),
    "shadertoy": Target("codegen.targets.shadertoy", suffix=".frag", opens=True),
    "cuda": Target("codegen.targets.cuda", suffix=".cu"),
    "glsl": Target("codegen.targets.glsl_function", suffix=".sdf.glsl", alone=True),
    "wgsl": Target("codegen.targets.wgsl", suffix=".wgsl", alone=True),
    "hlsl": Target("codegen.targets.hlsl", suffix=".hlsl", alone=True),
    "c": Target("codegen.targets.c", suffix=".c", alone=True),
    "python": Target("codegen.targets.python", suffix=".py", alone=True),
}
"""Name, as `--target` takes it -> target."""
DEFAULT = "glsl330"
"""Name of the target that is baked where none is given."""
