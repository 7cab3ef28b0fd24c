"""A model in a notebook: a picture that stays in the file, and the live page in a frame that draws only while seen."""

import base64
import html
import json
import sys
import tempfile
import webbrowser
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from ..model.errors import UserError
from ..web import page as webpage
from .pictures import png

if TYPE_CHECKING:
    from .field import Field

HEIGHT = 420
"""CSS pixels of the frame's height."""

_FRAME = """<!doctype html><meta charset="utf-8"><style>
html,body{margin:0;height:100%;overflow:hidden;background:#f6f5f2}
@media(prefers-color-scheme:dark){html,body{background:#1b1d22}}
button,iframe{position:absolute;inset:0;width:100%;height:100%;border:0;padding:0;background:none}
button{cursor:pointer}img{width:100%;height:100%;object-fit:contain}
</style><button type="button" aria-label="Turn it"><img alt="" src="PICTURE"></button>
<script type="application/json">PAGE</script><script>
const text = JSON.parse(document.querySelector("script").textContent), button = document.querySelector("button");
let frame = null;
function start() {
    if (frame) return;
    frame = document.createElement("iframe");
    frame.setAttribute("allow", "fullscreen");
    frame.srcdoc = text;
    document.body.append(frame);
}
function stop() {
    if (frame) frame.remove();
    frame = null;
}
button.addEventListener("click", start);
function turn(changes) {
    if (changes[changes.length - 1].isIntersecting) start();
    else stop();
}
new IntersectionObserver(turn, {threshold: 0.3}).observe(button);
</script>"""
"""A page around the page: the picture, and the page itself in a frame of its own while a third of it is in sight.

A browser holds some 16 WebGL contexts: removing the frame frees its own. No line of the script depends on the end of
another, for hosts may fold them.
"""


def mimebundle(field: "Field") -> dict[str, str]:
    """Return what a notebook keeps of a model: a PNG in base64, for those who show no pages, the page, and a line."""
    png = picture(field)
    return {"text/plain": repr(field), "image/png": png, "text/html": frame(field, png)}


def picture(field: "Field") -> str:
    """Draw a model from its front: the base64 of a PNG with a transparent background. It needs no OpenGL."""
    return base64.b64encode(png(field.model)).decode()


def frame(field: "Field", png: str) -> str:
    """Return HTML that shows a model live: an iframe whose document is in its attribute, escaped whole.

    png: what is seen until then, as `picture` gives it. It lies behind the iframe, too, which hosts take out of what
    they do not trust: notebooks by others, as JupyterLab and GitHub show them.
    """
    page = json.dumps(webpage.standalone(field.model)).replace("<", "\\u003c")
    document = _FRAME.replace("PICTURE", f"data:image/png;base64,{png}").replace("PAGE", page)
    name = html.escape(repr(field))
    return (
        f'<div style="position:relative;height:{HEIGHT}px">'
        f'<img alt="{name}" style="max-width:100%;max-height:100%" src="data:image/png;base64,{png}">'
        f'<iframe title="{name}" style="position:absolute;left:0;top:0;width:100%;height:100%;border:0" '
        f'sandbox="allow-scripts allow-downloads" allow="fullscreen" srcdoc="{html.escape(document)}"></iframe></div>'
    )


class Preview:
    """A picture in a notebook that is drawn anew for every further level of a training."""

    def __init__(self) -> None:
        """Raises UserError outside of a notebook."""
        if not in_notebook():
            raise UserError("preview: only a notebook has a place for it; `follow` receives every level elsewhere")
        self._display = import_module("IPython.display").display
        self._handle: Handle | None = None

    def show(self, field: "Field") -> None:
        """Draw what is trained so far, in the place of what was drawn before."""
        bundle = {"text/plain": repr(field), "image/png": picture(field)}
        if self._handle is None:
            self._handle = self._display(bundle, raw=True, display_id=True)
        else:
            self._handle.update(bundle, raw=True)


class Handle(Protocol):
    """A display of IPython that may be shown anew."""

    def update(self, bundle: dict[str, str], *, raw: bool) -> None:
        """Show something else."""


def show(field: "Field") -> None:
    """Display a model in a notebook; outside of one, open its page in the browser, from a new temporary file.

    Raises UserError where no browser can be opened; the message names the file.
    """
    if in_notebook():
        import_module("IPython.display").display(field)
        return
    name = "".join(c if c.isalnum() else "-" for c in field.name)[:60]
    path = Path(tempfile.mkdtemp(prefix="mplicits-"), f"{name}.html")
    path.write_text(webpage.standalone(field.model), encoding="utf-8")
    if not webbrowser.open(path.as_uri()):
        raise UserError(f"no browser can be opened here; open {path} in one")


def in_notebook() -> bool:
    """Whether this is a notebook's kernel."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return shell is not None and hasattr(shell, "kernel")
