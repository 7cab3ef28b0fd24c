"""A page before it is written, and its two forms: one that unpacks itself (view/packed.html), and the whole one."""

import base64
import html
import re
from dataclasses import dataclass, field
from typing import Any

from .. import glsl
from ..codegen.targets.baked import Baked
from ..model import page_style
from ..model.version import installed_version
from .about import about, icon_and_title
from .base124 import base124
from .bundle import modules, read, script
from .deflate import deflated
from .facts import facts_json
from .minified import minified, minified_style, short_names, short_script, short_shader
from .policy import hash_of
from .spaces import squeezed

ENTRY = "page.js"
"""The module that opens the page, with all that it imports."""
NO_PICTURE = "data:,"
"""URL in the place of a poster."""
DESCRIPTION = "A shape as a neural network: drag to turn it."
PALETTES = {"dark": page_style.variables(page_style.DARK), "light": page_style.variables(page_style.LIGHT)}
SHADER = "x-shader/x-fragment"
"""Type of a script element with GLSL."""
PREVIEW = "preview.glsl"
"""The studio's shader of a dropped shape."""
OWN_NAMES = ("prologue", "shadertoy.glsl")
"""Elements with GLSL from which scripts make texts for users."""

_PLACE = re.compile(r"\{\{(\w+)\}\}")
_CONTROL = re.compile(r"[\x00-\x1f]")
"""Characters that a title does not hold: `Parts` uses two of them."""
_INDENT, _EMPTY = re.compile(r"^[ \t]+", re.MULTILINE), re.compile(r"\n{2,}")
_STYLE_COMMENT = re.compile(r"/\* .*?\*/\n?", re.DOTALL)


@dataclass(frozen=True)
class Element:
    """A script element with data of the studio."""

    id: str
    type: str
    content: str | bytes
    """Text as it is written, or bytes, which the page holds as base64."""


@dataclass(frozen=True)
class Studio:
    """What the page that trains has beyond the page of a model."""

    modules: tuple[str, ...] = ()
    """Names of scripts, which stand before ENTRY."""
    stage: str = ""
    """HTML over the picture."""
    style: str = ""
    bar: str = ""
    """HTML below the picture."""
    elements: tuple[Element, ...] = ()
    facts: dict[str, Any] = field(default_factory=dict)
    """Further keys of `facts` (model/facts.js)."""
    policy: str = ""
    """Further sources and directives of the Content-Security-Policy, after script-src."""
    accept: str = ".safetensors"
    """Endings of files to open."""
    open: str = "Open model"
    hint: str = "Drop a .safetensors model anywhere."
    description: str = DESCRIPTION


@dataclass(frozen=True)
class Page:
    """The page of a model, or one without a model."""

    name: str
    facts: dict[str, Any]
    """Keys of `facts` (model/facts.js)."""
    data: bytes
    """The weights; empty without a model."""
    shaders: dict[str, str]
    """Name of an element -> GLSL, which opens and closes no tag."""
    poster: str = NO_PICTURE
    """A URL."""
    address: str = ""
    preview: str = ""
    """See `about`."""
    studio: Studio | None = None


@dataclass(frozen=True)
class Scripts:
    """The texts of a page's scripts: one before the first paint, and the page's in three parts."""

    early: str
    viewer: str
    studio: str = ""
    entry: str = ""

    def running(self) -> list[str]:
        """Return the scripts that run: also that of the page which the studio writes."""
        return [self.early, self.viewer + self.entry, self.viewer + self.studio + self.entry]


class Parts:
    """What a packed page holds beside its HTML, which has marks in their places.

    A mark stands between characters 1: a letter, the first byte and the number of bytes. The letters: b: bytes, as
    base64. t, s: text and bytes of the studio; the page that the studio writes has none of them. p: the poster.
    """

    poster = "\x01p\x01"

    def __init__(self) -> None:
        self.data = b""

    def mark(self, letter: str, data: bytes) -> str:
        """Add bytes, and return what stands in their place."""
        at, self.data = len(self.data), self.data + data
        return f"\x01{letter}{at},{len(data)}\x01"

    def text(self, text: str) -> str:
        """Add text of the studio, and return what stands in its place."""
        return self.mark("t", text.encode()) if text else ""


class Inline(Parts):
    """Puts all parts into the HTML."""

    def __init__(self, poster: str) -> None:
        super().__init__()
        self.poster = poster

    def mark(self, letter: str, data: bytes) -> str:
        """Return text, or bytes as base64."""
        return data.decode() if letter == "t" else base64.b64encode(data).decode()


def packed(page: Page) -> Baked:
    """Write a page that unpacks itself in the browser.

    Title, policy and poster stay readable, so that the poster is seen before a script runs. `globalThis.packedPage` in
    the browser is {outer, html}: the text of the page that unpacks, without its first line, and of the unpacked page.
    """
    parts, unpacker = Parts(), minified(short_script(read("view/unpacker.js")))
    scripts = _scripts(page.studio)
    inner = _html(page, scripts, parts, icon_and_title(_title(page)))
    policy = _policy(page, [unpacker, *scripts.running()])  # browsers keep it for the inner page
    outer = {
        "version": installed_version(),
        "policy": policy,
        "css": _style(read("view/packed.css")),
        "about": " ".join(_about(page).split()),
        "poster": page.poster,
        "unseen": _unseen(page),
        "packed": base124(deflated(b"\0".join([inner.encode(), parts.data]))),
        "unpacker": unpacker,
    }
    return Baked(_filled(_outdented(read("view/packed.html")), outer), policy=policy)


def whole(page: Page) -> str:
    """Write a page as it is after unpacking, for frames whose text may lack control characters, as in notebooks."""
    scripts = _scripts(page.studio)
    line = f'<meta http-equiv="Content-Security-Policy" content="{_policy(page, scripts.running())}">\n'
    return _html(page, scripts, Inline(page.poster), line + _about(page))


def _html(page: Page, scripts: Scripts, parts: Parts, head: str) -> str:
    """Return the HTML of a page, without comments, indentation and most spaces."""
    more = page.studio or Studio()
    # The first of the parts: near to scripts, scripts have few bytes.
    script = scripts.viewer + parts.text(scripts.studio) + scripts.entry
    style = _PLACE.sub(lambda match: PALETTES[match[1]], read("view/page.css"))
    slots = {
        "state": "" if page.data else ' data-state="empty"',
        "head": head,
        "css": _style(style) + parts.text(_style(more.style)),
        "early": scripts.early,
        "poster": parts.poster,
        "unseen": _unseen(page),
        "stage": parts.text(_outdented(more.stage)),
        "facts": facts_json(page.facts | more.facts),
        "weights": parts.mark("b", page.data) if page.data else "",
        "shaders": "\n".join(_element(SHADER, name, text) for name, text in _shaders(page, scripts).items()),
        "elements": parts.text(_outdented(more.bar)) + "".join(_of_studio(element, parts) for element in more.elements),
        "js": script,
        **{key: html.escape(getattr(more, key)) for key in ("accept", "open", "hint")},
    }
    return _filled(_outdented(read("view/page.html")), slots)


def _policy(page: Page, scripts: list[str]) -> str:
    sources = " ".join(map(hash_of, dict.fromkeys(scripts))) + (page.studio or Studio()).policy
    return f"default-src 'none'; script-src {sources}; style-src 'unsafe-inline'; img-src data: blob:"


def _title(page: Page) -> str:
    return _CONTROL.sub("", page.name)


def _about(page: Page) -> str:
    return about(_title(page), (page.studio or Studio()).description, page.address, page.preview)


def _unseen(page: Page) -> str:
    return " hidden" if page.poster == NO_PICTURE else ""


def _scripts(studio: Studio | None) -> Scripts:
    """Return the scripts in short. Without the studio, which needs them, all names of the page's script are short."""
    early = minified(short_script(read("view/before_paint.js")))
    *before, entry = modules(ENTRY)
    if studio is None:
        return Scripts(early, minified(script([*before, entry])))
    texts = (script(before), script(studio.modules, after=[*before, entry]), script([entry], after=before))
    return Scripts(early, *(squeezed(short_script(text)) for text in texts))


def _shaders(page: Page, scripts: Scripts) -> dict[str, str]:
    """Return the shaders in short. Those of OWN_NAMES keep all names, the others those in the viewer's scripts.

    The studio's preview includes some of them. Its names are kept in every page, so that an exported page is Python's.
    """
    texts = {name: short_shader(text) for name, text in page.shaders.items()}
    kept = [facts_json({}), *(texts[name] for name in OWN_NAMES), scripts.viewer, scripts.entry, glsl.read(PREVIEW)]
    short = short_names({name: text for name, text in texts.items() if name not in OWN_NAMES}, "\n".join(kept))
    return texts | short


def _of_studio(element: Element, parts: Parts) -> str:
    if isinstance(element.content, bytes):
        start, end = _element(element.type, element.id, "\n").split("\n")
        return parts.text(start) + parts.mark("s", element.content) + parts.text(end + "\n")
    return parts.text(_element(element.type, element.id, element.content) + "\n")


def _element(kind: str, name: str, text: str) -> str:
    return f'<script type="{kind}" id="{name}">{text}</script>'


def _style(text: str) -> str:
    return minified_style(_outdented(_STYLE_COMMENT.sub("", text)))


def _outdented(text: str) -> str:
    return _EMPTY.sub("\n", _INDENT.sub("", text))


def _filled(text: str, slots: dict[str, str]) -> str:
    return _PLACE.sub(lambda match: slots[match[1]], text)
