"""Target html: the page of page.py, packed into one that unpacks itself in the browser (view/packed.html)."""

import base64
import re
from typing import Any

from ..model.model import Model
from ..model.version import installed_version
from . import page as whole_page
from .base124 import base124
from .bundle import read
from .deflate import deflated
from .minified import minified, minified_style, short_script, short_shader
from .policy import ANY, hashes
from .short_weights import page_weights, short_weights
from .spaces import squeezed

BINARY = "application/octet-stream"
"""Type of the script elements with base64, which is stored as bytes."""
WORKER = "text/x-worker"
"""Type of the script elements with the text of a worker."""
COMPUTE = "x-shader/x-compute"
"""Type of the script elements with WGSL."""
MARK = "\x01"
"""In the HTML, before and after the number of bytes of a binary part, or before and after "poster"."""

_ELEMENT = re.compile(r"(<(script|style)\b([^>]*)>)(.*?)(</\2>)", re.DOTALL)
_TYPE = re.compile(r'type="([^"]*)"')
_POLICY = re.compile(r'<meta http-equiv="Content-Security-Policy"\s+content="([^"]*)">\n?')
_STUDIO = re.compile(r"(?:/\*|<!--)studio(?:\*/|-->).*?(?:/\*|<!--)end(?:\*/|-->)\n?", re.DOTALL)
"""A part of the studio, between the marks of page.py."""
_ABOUT = re.compile(r'<link rel="icon".*?(?=\n<style>)', re.DOTALL)
_TOLD = re.compile(r"<meta (?:property|name=\"(?:description|twitter:card))[^>]*>\n?")
"""Lines of about.py for readers of links, which run no script: only the page that unpacks needs them."""
_POSTER = re.compile(r'(?<=<img id="poster" alt="" src=")[^"]*')
_INDENT, _EMPTY = re.compile(r"^[ \t]+", re.MULTILINE), re.compile(r"\n{2,}")
_STYLE_COMMENT = re.compile(r"/\* .*?\*/\n?", re.DOTALL)
"""Not the marks of the studio's parts, which have no spaces."""


def standalone(model: Model, **options: Any) -> str:
    """Return the page of a model, packed. options: of `page.standalone`. Raises UserError."""
    return packed(whole_page.standalone(model, short=True, **options), alone=True)


def rounding(model: Model, storage: str = "auto", digits: int | None = None) -> str | None:
    """Say how far the page's weights are rounded. See `bake.registry.Target.rounding`."""
    return page_weights(model, digits, short_weights).line


def packed(page: str, alone: bool = False) -> str:
    """Return a page that replaces itself with `page`, without its comments, indentation and most spaces.

    page: text of `page.standalone` or `page.without_model`. alone: rename all names of its script; the studio needs
    them, and its parts, as they are. Title, policy and poster stay readable, so that the poster is seen before a script
    runs. `globalThis.packedPage` in the browser is {outer, html}: the text of the page that unpacks, without its first
    line, and of the unpacked page.
    """
    parts: list[bytes] = []
    inner = _TOLD.sub("", _POLICY.sub("", _POSTER.sub(f"{MARK}poster{MARK}", short(page, parts, alone))))
    outer = short(read("view/packed.html"), [], alone)
    # Browsers keep the outer policy. The page that the studio writes lacks the studio, and has another script.
    sources = hashes(outer + _STUDIO.sub("", inner) + inner)
    data = deflated(b"\0".join([inner.encode(), b"".join(parts)]))
    slots = {
        "version": installed_version(),
        "policy": _first(_POLICY, page).replace(ANY, sources, 1),
        "about": _first(_ABOUT, page),
        "poster": _first('<img id="poster"[^>]*>', page),
        "packed": base124(data),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda match: slots[match[1]], outer)


def short(page: str, parts: list[bytes], alone: bool = False) -> str:
    """Return a page with short scripts, and without indentation and the comments of its shaders and style.

    The content of elements of type BINARY moves to `parts`. alone: see `packed`.
    """
    pieces, end = [], 0
    for match in _ELEMENT.finditer(page):
        pieces += [_outdented(page[end : match.start()]), match[1], _short(match, parts, alone), match[5]]
        end = match.end()
    return "".join([*pieces, _outdented(page[end:])])


def _short(match: re.Match[str], parts: list[bytes], alone: bool) -> str:
    """Shorten the content of an element. match: of _ELEMENT. alone: see `packed`."""
    content, kind = match[4], _TYPE.search(match[3])
    if match[2] == "style":
        style = _outdented(_STYLE_COMMENT.sub("", content))
        return minified_style(style) if alone else style
    if alone and (kind is None or kind[1] == "module"):
        return minified(content)
    if kind is None or kind[1] in ("module", WORKER):
        return squeezed(short_script(content))
    if kind[1] in (COMPUTE, "x-shader/x-fragment"):
        return short_shader(content)
    if kind[1] != BINARY or not content.strip():
        return content
    parts.append(base64.b64decode(content))
    return f"{MARK}{len(parts[-1])}{MARK}"


def _outdented(text: str) -> str:
    return _EMPTY.sub("\n", _INDENT.sub("", text))


def _first(pattern: str | re.Pattern[str], page: str) -> str:
    found = re.search(pattern, page)
    assert found is not None
    return " ".join(found[found.re.groups].split())
