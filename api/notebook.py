"""A model in a notebook: a picture that the file keeps, and the live page in a frame that runs only while visible."""

import base64
import html
import json
import re
import sys
import tempfile
import webbrowser
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

from ..model.errors import UserError
from ..model.model import Model
from ..model.page_style import DARK, LIGHT
from ..web.document import whole
from ..web.page import page_of, standalone
from .pictures import file_name, png

HEIGHT = 420
"""CSS pixels of the frame's height."""

_FRAME = """<!doctype html><meta charset="utf-8"><style>
html,body{margin:0;height:100%;overflow:hidden;background:LIGHT}
@media(prefers-color-scheme:dark){html,body{background:DARK}}
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
"""The document around the page: the picture, and the page in a frame while a third of it is visible.

Browsers keep some 16 WebGL contexts; removing the frame frees its context. Each line of the script ends a statement or
opens a block, because some hosts join lines.
"""


class Shown(Protocol):
    """What a notebook shows: a `Field`."""

    @property
    def model(self) -> Model: ...

    @property
    def name(self) -> str: ...


def mimebundle(field: Shown) -> dict[str, str]:
    """Return the displays of a model: a line of text, a PNG in base64 for hosts without HTML, and the live page."""
    png = picture(field)
    return {"text/plain": repr(field), "image/png": png, "text/html": frame(field, png)}


def picture(field: Shown) -> str:
    """Draw a model from its front: the base64 of a PNG with a transparent background. It needs no OpenGL."""
    return base64.b64encode(png(field.model)).decode()


def frame(field: Shown, png: str) -> str:
    """Return HTML with an iframe that runs the page of a model; the document is in an attribute, fully escaped.

    png: `picture(field)`, visible before the page runs. It is also behind the iframe: JupyterLab and GitHub remove
    iframes from notebooks that they do not trust.
    """
    page = json.dumps(whole(page_of(field.model)[0])).replace("<", "\\u003c")
    content = {
        "LIGHT": LIGHT["surface"],
        "DARK": DARK["surface"],
        "PICTURE": f"data:image/png;base64,{png}",
        "PAGE": page,
    }
    # In one pass: the picture's characters may spell any of the names.
    document = re.sub("|".join(content), lambda found: content[found[0]], _FRAME)
    name = html.escape(repr(field))
    return (
        f'<div style="position:relative;height:{HEIGHT}px">'
        f'<img alt="{name}" style="max-width:100%;max-height:100%" src="data:image/png;base64,{png}">'
        f'<iframe title="{name}" style="position:absolute;left:0;top:0;width:100%;height:100%;border:0" '
        f'sandbox="allow-scripts allow-downloads" allow="fullscreen" srcdoc="{html.escape(document)}"></iframe></div>'
    )


class NotebookPreview:
    """A picture in a notebook that each level of a training replaces."""

    def __init__(self) -> None:
        """Raises UserError outside of a notebook."""
        if not in_notebook():
            raise UserError("preview: works in notebooks only; elsewhere name a folder, or use `after_level`")
        self._display = import_module("IPython.display").display
        self._handle: Any = None  # IPython's handle of the display

    def show(self, field: Shown) -> None:
        """Replace the picture by one of this model."""
        bundle = {"text/plain": repr(field), "image/png": picture(field)}
        if self._handle is None:
            self._handle = self._display(bundle, raw=True, display_id=True)
        else:
            self._handle.update(bundle, raw=True)


def show(field: Shown) -> None:
    """Display a model in a notebook; elsewhere, open its page in the web browser, from a new temporary file.

    Raises UserError, which names the file, where no browser opens.
    """
    if in_notebook():
        import_module("IPython.display").display(field)
        return
    path = Path(tempfile.mkdtemp(prefix="mplicits-"), f"{file_name(field.name)}.html")
    path.write_text(standalone(field.model), encoding="utf-8")
    if not webbrowser.open(path.as_uri()):
        raise UserError(f"no browser can be opened here; open {path} in one")


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return shell is not None and hasattr(shell, "kernel")
