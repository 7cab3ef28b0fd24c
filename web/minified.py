"""Scripts in few bytes: by tdewolff-minify where it is installed, else by dropping comments and indentation."""

import re
from itertools import product
from string import ascii_lowercase

from .spaces import without_blocks

_INDENT = re.compile(r"^[ \t]+", re.MULTILINE)
_COMMENT_LINE = re.compile(r"^//.*\n?", re.MULTILINE)
_COMMENT_AT_END = re.compile(r"[ \t]+// [^\n`'\"]*$", re.MULTILINE)
"""Without quotes, in which the slashes might be text."""
_SHADER_COMMENT = re.compile(r"[ \t]*//.*$", re.MULTILINE)
"""Shaders have no text."""
_CODE_LINE = re.compile(r"^[^#\n].*", re.MULTILINE)
"""A line of a shader that is no directive."""
_SPACES = re.compile(r" *([*/=<>,;(){}?:&|]) *|(?<![-+]) *([-+](?! *[-+])) *")
"""Spaces that it does not need; those between two signs it does."""
_WORD = re.compile(r"[A-Za-z_]\w*")
_WORD_OR_FILE = re.compile(rf'"[^"]*"|{_WORD.pattern}')
_DECLARED = re.compile(r"(?:#define|struct|void|bool|float|u?int|[iu]?vec[234]|mat[234]) +([A-Za-z_]\w{2,})")
"""A name in a shader, where it is declared."""
_SWIZZLE = re.compile(r"[xyzw]+|[rgba]+|[stpq]+")
_END_OF_STATEMENT = re.compile(r"(?<=[;{},])\n(?!#|\Z)")
_DECLARATION = re.compile(r"(?<!\(\n)^(const|let) ", re.MULTILINE)
"""Start of a declaration in a script without indentation, not in a loop's head."""
_TOKEN = re.compile(r"""'(?:\\.|[^'\\])*'|"(?:\\.|[^"\\])*"|`(?:\\.|[^`\\])*`|[()\[\]{},;]""", re.DOTALL)
"""A literal (templates in a template do not nest in declarations with patterns), a bracket or a separator."""
_FENCE = "fence_()"
_FENCES = re.compile(r",fence_\(\)|fence_\(\)[,;]")


def minified(script: str) -> str:
    """Return JavaScript in few bytes. No other script may use its names: all of them are renamed.

    tdewolff-minify has no wheels for some machines.
    """
    try:
        import minify
    except ImportError:
        return short_script(script)
    # Inside a function, top-level names are local, and are renamed, too.
    source = f"async function _(){{{fenced(short_script(script))}\n}}"
    text = _FENCES.sub("", minify.string("application/javascript", source))
    if _FENCE in text:
        raise ValueError("the minifier moved a fence")
    return re.sub(r"^async function _\(\)\{|\}$", "", text)


def minified_style(style: str) -> str:
    """Return CSS in few bytes; unchanged where tdewolff-minify is not installed."""
    try:
        import minify
    except ImportError:
        return style
    text: str = minify.string("text/css", style)
    return text


def fenced(script: str) -> str:
    """Return a short script in which a call stands before every declaration of a pattern, such as `const [a, b] = c;`.

    tdewolff-minify 2.24 joins declarations, and moves those of patterns ahead of names that they read (its issue 958).
    It joins none across a call.
    """
    pieces, end = [], 0
    for start in _DECLARATION.finditer(script):
        if start.start() < end:
            continue
        pieces.append(script[end : start.start()])
        end = _end(script, start.end())
        names = _split(script[start.end() : end - 1])
        fences = [f"{_FENCE};" if name.lstrip().startswith(("[", "{")) else "" for name in names]
        if any(fences):
            pieces += [f"{fence}{start[0]}{name.strip()};" for fence, name in zip(fences, names, strict=True)]
        else:
            pieces.append(script[start.start() : end])
    return "".join([*pieces, script[end:]])


def _end(script: str, at: int) -> int:
    """Return the index after the semicolon that ends the statement around `at`."""
    depth = 0
    for token in _TOKEN.finditer(script, at):
        depth += (token[0] in "([{") - (token[0] in ")]}")
        if token[0] == ";" and not depth:
            return token.end()
    raise ValueError("a declaration has no end")


def _split(declaration: str) -> list[str]:
    """Split a declaration at the commas between its names."""
    depth, start, names = 0, 0, []
    for token in _TOKEN.finditer(declaration):
        depth += (token[0] in "([{") - (token[0] in ")]}")
        if token[0] == "," and not depth:
            names.append(declaration[start : token.start()])
            start = token.end()
    return [*names, declaration[start:]]


def short_script(text: str) -> str:
    """Return JavaScript, GLSL or WGSL without indentation and comments; of GLSL and WGSL, comments from /* to */ stay.

    Lines of the text that lie in a string must not look like comments, and their indentation is lost.
    """
    code = without_blocks(text) if "/**" in text else text
    return _COMMENT_AT_END.sub("", _COMMENT_LINE.sub("", _INDENT.sub("", code)))


def short_shader(text: str) -> str:
    """Return GLSL or WGSL without indentation, comments and most spaces."""
    code = _SHADER_COMMENT.sub("", short_script(text))
    return _CODE_LINE.sub(lambda line: _SPACES.sub(r"\1\2", line[0]), code)


def short_names(shaders: dict[str, str], others: str) -> dict[str, str]:
    """Return short shaders, which may include one another, with names of two letters, and with fewer lines.

    others: all other text with names of the shaders; these stay.
    """
    text, taken = "\n".join(shaders.values()), set(_WORD.findall(others))
    free = (
        a + b
        for a, b in product(ascii_lowercase, repeat=2)
        if a + b not in taken.union(_WORD.findall(text), ("do", "if", "in"))
    )
    own = [
        name for name in dict.fromkeys(_DECLARED.findall(text)) if name not in taken and not _SWIZZLE.fullmatch(name)
    ]
    short = dict(zip(own, free, strict=False))

    def renamed(shader: str) -> str:
        return _WORD_OR_FILE.sub(lambda word: short.get(word[0], word[0]), shader)

    return {name: _END_OF_STATEMENT.sub("", renamed(shader)) for name, shader in shaders.items()}
