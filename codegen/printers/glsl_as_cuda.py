"""Prints hand-written GLSL functions of glsl/ as CUDA C++, so that CUDA needs no second version."""

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import NoReturn

TYPES = frozenset({"bool", "int", "uint", "float", "ivec3", "vec2", "vec3", "vec4", "mat3", "mat4"})
"""GLSL's types in CUDA; cuda_source/vectors.cuh defines the vectors and matrices."""
BUILT_INS = frozenset(
    {"abs", "clamp", "dot", "floor", "max", "min", "mix", "normalize", "pow", "reflect", "smoothstep", "sqrt", "step"}
)
"""GLSL's functions in vectors.cuh."""
MEMBERS = frozenset({"x", "y", "z", "w", "xyz"})
"""Components and swizzles in vectors.cuh."""
KEYWORDS = frozenset({"if", "else", "for", "while", "do", "return", "break", "continue", "const", "true", "false"})
"""Keywords with the same meaning in both languages."""

_TOKEN = re.compile(
    r"""(?P<before>(?:\s+|//[^\n]*|/\*.*?\*/)*)
    (?:(?P<float>(?:(?:\d+\.\d*|\.\d+)(?:[eE][-+]?\d+)?|\d+[eE][-+]?\d+)(?![\w.]))
    |(?P<integer>(?:0|[1-9]\d*)u?(?![\w.]))
    |(?P<word>[A-Za-z_]\w*)
    |(?P<sign>\+\+|--|&&|\|\||<<|>>|[-+*/%<>=!]=|/(?![/*])|[-+*%<>=!&|~?:;,.(){}[\]])
    |(?P<end>\Z)
    |(?P<unknown>\S+))""",
    re.VERBOSE | re.DOTALL,
)


class UnknownGlslError(ValueError):
    """GLSL text that the printer cannot translate."""


@dataclass(frozen=True)
class Token:
    """A word, number or sign of GLSL, with the space in front of it."""

    kind: str
    """float, integer, word, sign, or end."""
    text: str
    """Empty at the end."""
    before: str
    """White space and comments in front of the token; they are copied."""
    line: int
    """Line number, from 1."""


def glsl_as_cuda(source: str, outside: Collection[str] = ()) -> str:
    """Print GLSL functions, structs and constants as CUDA C++, with their comments.

    source: GLSL without directives. outside: functions and variables that it uses without a declaration. A struct's
    bool becomes an int, so that a struct of 32-bit members has no padding. Raises UnknownGlslError for everything
    without a
    known equivalent: other types, built-in functions, swizzles and qualifiers, undeclared names, array parameters,
    global variables, directives.
    """
    return _Printer(source, outside).file()


def tokens(source: str) -> Iterator[Token]:
    """Split GLSL into tokens; the last one is the end. Raises UnknownGlslError at unknown text."""
    for match in _TOKEN.finditer(source):
        kind = str(match.lastgroup)
        line = source.count("\n", 0, match.start(kind)) + 1
        if kind == "unknown":
            raise UnknownGlslError(f"line {line}: {match[kind]!r} is not GLSL that CUDA knows")
        yield Token(kind, match[kind], match["before"], line)
        if kind == "end":
            return


class _Printer:
    """Goes through the tokens once: declarations by grammar, statements and expressions token by token."""

    def __init__(self, source: str, outside: Collection[str]) -> None:
        self.tokens = list(tokens(source))
        self.position = 0
        self.types = {*TYPES}
        self.names = {*BUILT_INS, *outside}
        self.members = {*MEMBERS}
        self.printed: list[str] = []

    @property
    def here(self) -> Token:
        return self.tokens[self.position]

    def file(self) -> str:
        while self.here.kind != "end":
            match self.here.text:
                case "struct":
                    self._struct()
                case "const":
                    self._constant()
                case _:
                    self._function()
        return "".join(self.printed) + self.here.before

    def _struct(self) -> None:
        """`struct Name { type member; ... };`, to which CUDA adds GLSL's constructor."""
        self._print("struct")
        name = self._word()
        self.types.add(name)
        self._print("{")
        members = []
        while self.here.text != "}":
            kind = self._type({"bool": "int"})
            members.append((kind, self._word()))
            self._print(";")
        self.members |= {member for _, member in members}
        parameters = ", ".join(f"{kind} {member}" for kind, member in members)
        values = ", ".join(f"{member}({member})" for _, member in members)
        self.printed += [
            self.here.before.rstrip(),
            f"\n    {name}() = default;\n    __device__ {name}({parameters}) : {values} {{}}\n",
        ]
        self._print("}", before="")
        self._print(";")

    def _constant(self) -> None:
        """`const type NAME = expression;` outside of functions."""
        self._print("const", "inline constexpr")
        self._type()
        self.names.add(self._word())
        self._print("=")
        while self.here.text != ";":
            self._token()
        self._print(";")

    def _function(self) -> None:
        """A function's definition or prototype."""
        self.printed += [self.here.before, "__device__ inline "]
        self._type({"void": "void"}, before="")
        self.names.add(self._word())
        self._print("(")
        while self.here.text != ")":
            self._parameter()
            if self.here.text == ",":
                self._print(",")
        self._print(")")
        if self.here.text == ";":
            self._print(";")
        else:
            self._block()

    def _parameter(self) -> None:
        reference = self.here.text in {"out", "inout"}
        before = None
        if reference or self.here.text == "in":
            before = self.here.before
            self.position += 1
        self._type(before=before)
        self.names.add(self._word("&" if reference else ""))
        if self.here.text == "[":
            self._refuse("an array as a parameter")

    def _block(self) -> None:
        self._print("{")
        while self.here.text != "}":
            if self.here.text == "{":
                self._block()
            else:
                self._token()
        self._print("}")

    def _token(self) -> None:
        """Print one token of a statement or an expression."""
        token = self.here
        if token.kind == "end":
            self._refuse("the text ends inside a function")
        if token.kind == "float":
            self._print(token.text, token.text + "f")
        elif token.kind != "word" or token.text in KEYWORDS:
            self._print(token.text)
        elif self.tokens[self.position - 1].text == ".":
            if token.text not in self.members:
                self._refuse("a member or swizzle that CUDA's vectors lack")
            self._print(token.text)
        elif token.text in self.types:
            self._type()
            if self.here.text == "[":
                self._refuse("an array made by a constructor")
            if self.here.kind == "word":
                self.names.add(self._word())
        else:
            if token.text not in self.names:
                self._refuse("a name that is neither declared nor known")
            self._print(token.text)

    def _type(self, others: dict[str, str] | None = None, before: str | None = None) -> str:
        """Print the next token, a type, and return it. others: GLSL's types with another name in CUDA."""
        kind = (others or {}).get(self.here.text)
        if kind is None:
            if self.here.text not in self.types:
                self._refuse("not a type that CUDA knows")
            kind = self.here.text
        self._print(self.here.text, kind, before)
        return kind

    def _word(self, prefix: str = "") -> str:
        """Print the next token, a name, and return it."""
        name = self.here.text
        if self.here.kind != "word" or name in KEYWORDS | self.types:
            self._refuse("not a name")
        self._print(name, prefix + name)
        return name

    def _print(self, text: str, printed: str | None = None, before: str | None = None) -> None:
        """Print the next token, which must be `text`, as `printed`. before: replaces the space in front of it."""
        if self.here.text != text:
            self._refuse(f"not {text!r}")
        self.printed += [self.here.before if before is None else before, text if printed is None else printed]
        self.position += 1

    def _refuse(self, reason: str) -> NoReturn:
        raise UnknownGlslError(f"line {self.here.line}: {self.here.text!r} is {reason}")
