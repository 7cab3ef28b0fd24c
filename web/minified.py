"""Scripts in few bytes: by tdewolff-minify where it is installed, else by dropping comments and indentation."""

import re

_INDENT = re.compile(r"^[ \t]+", re.MULTILINE)
_COMMENT_LINE = re.compile(r"^//.*\n?", re.MULTILINE)
_COMMENT_AT_END = re.compile(r"[ \t]+// [^\n`'\"]*$", re.MULTILINE)
"""Without quotes, in which the slashes might be text."""


def minified(script: str) -> str:
    """Return JavaScript in few bytes. It may use `await`; its own names are renamed, so that no other script sees them.

    tdewolff-minify has no wheels for some machines.
    """
    try:
        import minify
    except ImportError:
        return short_script(script)
    # Inside a function, top-level names are local, and are renamed, too.
    text = minify.string("application/javascript", f"async function _(){{{script}\n}}")
    return re.sub(r"^async function _\(\)\{|\}$", "", text)


def short_script(text: str) -> str:
    """Return JavaScript, GLSL or WGSL without indentation, and without comments from // to the line's end.

    Lines of the text that lie in a string must not look like comments, and their indentation is lost.
    """
    return _COMMENT_AT_END.sub("", _COMMENT_LINE.sub("", _INDENT.sub("", text)))
