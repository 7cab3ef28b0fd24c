"""Packs a page into one that unpacks itself in the browser (app/packed.html), at about a third of the bytes."""

import base64
import re
import zlib
from importlib.resources import files

from ..model.version import installed_version

BINARY = "application/octet-stream"
"""Type of the script elements with base64, which is stored as bytes."""
WORKER = "text/x-worker"
"""Type of the script elements with the text of a worker."""
COMPUTE = "x-shader/x-compute"
"""Type of the script elements with WGSL."""
LINE = 4000
"""Characters of a line of the packed text."""
MARK = "\x01"
"""In the HTML, before and after the number of bytes of a binary part, or before and after "poster"."""

_ELEMENT = re.compile(r"(<(script|style)\b([^>]*)>)(.*?)(</\2>)", re.DOTALL)
_TYPE = re.compile(r'type="([^"]*)"')
_POSTER = re.compile(r'(?<=<img id="poster" alt="" src=")[^"]*')
_INDENT, _EMPTY = re.compile(r"^[ \t]+", re.MULTILINE), re.compile(r"\n{2,}")
_COMMENT_LINE = re.compile(r"^//.*\n?", re.MULTILINE)
_COMMENT_AT_END = re.compile(r"[ \t]+// [^\n`'\"]*$", re.MULTILINE)
"""Without quotes, in which the slashes might be text."""
_STYLE_COMMENT = re.compile(r"/\* .*?\*/\n?", re.DOTALL)
"""Not the marks of the studio's parts, which have no spaces."""


def packed(page: str) -> str:
    """Return a page that replaces itself with `page`, without its comments and indentation.

    page: text of `page.standalone` or `page.without_model`. Its title, policy and poster stay readable, so that the
    poster is seen before a script runs. `globalThis.packedPage` in the browser is {outer, html}: the text of the page
    that unpacks, without its first line, and of the unpacked page.
    """
    parts: list[bytes] = []
    inner = _POSTER.sub(f"{MARK}poster{MARK}", short(page, parts))
    encoder = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS, 9)
    data = encoder.compress(b"\0".join([inner.encode(), b"".join(parts)])) + encoder.flush()
    slots = {
        "version": installed_version(),
        "policy": _first(r'http-equiv="Content-Security-Policy"\s+content="([^"]*)"', page),
        "title": _first(r"<title>(.*?)</title>", page),
        "poster": _first('<img id="poster"[^>]*>', page),
        "packed": base94(data),
    }
    outer = files(__package__).joinpath("app", "packed.html").read_text("utf-8")
    return re.sub(r"\{\{(\w+)\}\}", lambda match: slots[match[1]], outer)


def short(page: str, parts: list[bytes]) -> str:
    """Return a page without indentation, and without the comments of its scripts, shaders and style.

    The content of elements of type BINARY moves to `parts`.
    """
    pieces, end = [], 0
    for match in _ELEMENT.finditer(page):
        pieces += [_outdented(page[end : match.start()]), match[1], _short(match, parts), match[5]]
        end = match.end()
    return "".join([*pieces, _outdented(page[end:])])


def _short(match: re.Match[str], parts: list[bytes]) -> str:
    """Shorten the content of an element. match: of _ELEMENT."""
    content, kind = match[4], _TYPE.search(match[3])
    if match[2] == "style":
        return _outdented(_STYLE_COMMENT.sub("", content))
    if kind is None or kind[1] in ("module", WORKER, COMPUTE, "x-shader/x-fragment"):
        return short_script(content)
    if kind[1] != BINARY or not content.strip():
        return content
    parts.append(base64.b64decode(content))
    return f"{MARK}{len(parts[-1])}{MARK}"


def short_script(text: str) -> str:
    """Return JavaScript, GLSL or WGSL without indentation, and without comments from // to the line's end.

    Lines of the text that lie in a string must not look like comments, and their indentation is lost.
    """
    return _COMMENT_AT_END.sub("", _outdented(_COMMENT_LINE.sub("", _INDENT.sub("", text))))


def _outdented(text: str) -> str:
    return _EMPTY.sub("\n", _INDENT.sub("", text))


def base94(data: bytes) -> str:
    """Encode bytes in lines of the printable characters but <, so that no tag can start in the text.

    Nine bytes, a big-endian number, are eleven digits: characters 33 to 126, with a space in place of <. A last group
    of fewer bytes, filled with zeros, loses the digits that it does not need.
    """
    groups = []
    for at in range(0, len(data), 9):
        part = data[at : at + 9]
        value, digits = int.from_bytes(part.ljust(9, b"\0")), []
        for _ in range(11):
            value, digit = divmod(value, 94)
            digits.append(chr(33 + digit))
        groups.append("".join(reversed(digits))[: -(-11 * len(part) // 9)])
    text = "".join(groups).replace("<", " ")
    return "\n".join(text[i : i + LINE] for i in range(0, len(text), LINE))


def _first(pattern: str, page: str) -> str:
    found = re.search(pattern, page)
    assert found is not None
    return " ".join(found[found.re.groups].split())
