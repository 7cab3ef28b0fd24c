"""JavaScript without the spaces that it does not need."""

import re
from collections.abc import Iterator

_REGEX = r"(?:(?<=[=(,:!&|?\[;{>])|(?<=return))\s*(/(?![*/])(?:\\.|\[(?:\\.|[^\]\\\n])*\]|[^/\\\n\[])+/)"
"""A regular expression, not a division: what stands before it is no value."""
_COMMENT = r"/\*(?:[^*]|\*(?!/))*\*/"
_BLOCK = rf"(?m:^[ \t]*){_COMMENT}\n|{_COMMENT}[ \t]*"
_PIECE = re.compile(rf"""'(?:\\.|[^'\\])*'|"(?:\\.|[^"\\])*"|{_BLOCK}| *//[^\n]*|{_REGEX}|[`{{}}]""")
_TEXT = re.compile(r"(?:\\.|[^`\\$]|\$(?!\{))*(`|\$\{)", re.DOTALL)
"""The text of a template, up to its end or to an expression in it."""
_SPACES = re.compile(r"\s*([*/%=<>,;({?:&|!\[^])\s*|\s*([)}\]]) *")
"""A mark, and the space beside it. A line's end after a closing bracket may end a statement."""
_LAST_MARK = re.compile(r",(?=[)}\]])|(?<![):]);(?=\})")
"""A comma or a semicolon before a closing bracket. A semicolon after a parenthesis may be an empty statement."""


def squeezed(script: str) -> str:
    """Return JavaScript without comments, last semicolons of blocks, and the space beside its marks.

    Strings, templates and regular expressions keep theirs.
    """
    pieces, end = [], 0
    for start, after in _texts(script):
        text = script[start:after]
        pieces += [_short(script[end:start]), "" if text.lstrip().startswith(("//", "/*")) else text]
        end = after
    return "".join([*pieces, _short(script[end:])])


def without_blocks(script: str) -> str:
    """Return JavaScript without comments from /* to */, which may fill lines."""
    pieces, end = [], 0
    for start, after in _texts(script):
        if script[start:after].lstrip().startswith("/*"):
            pieces.append(script[end:start])
            end = after
    return "".join([*pieces, script[end:]])


def _short(code: str) -> str:
    return _LAST_MARK.sub("", _SPACES.sub(r"\1\2", code))


def _texts(script: str) -> Iterator[tuple[int, int]]:
    """Yield start and end of the strings, comments, regular expressions, and parts of templates in a script."""
    opened: list[bool] = []  # whether each open brace belongs to an expression in a template
    at = 0
    while piece := _PIECE.search(script, at):
        at, first = piece.end(), piece[0]
        if first == "{":
            opened.append(False)
        elif first == "`" or (first == "}" and opened.pop()):
            text = _TEXT.match(script, at)
            assert text is not None
            at = text.end()
            if text[1] != "`":
                opened.append(True)
            yield piece.start(), at
        elif first != "}":
            yield piece.start(1) if piece[1] else piece.start(), at
