"""JavaScript without the spaces that it does not need."""

import pytest

from mplicits.web.spaces import squeezed, without_blocks

CASES = {
    "const a = {b: 1, c: [d, e]};": "const a={b:1,c:[d,e]};",
    "a = b + -c - --d; // it's 1": "a=b + -c - --d;",
    "say(\"a = b; // c\", 'd { e');": "say(\"a = b; // c\",'d { e');",
    "`a { ${b ? `${c.d({e: 1})} , f` : g} = h`;": "`a { ${b?`${c.d({e:1})} , f`:g} = h`;",
    "return / *[ /'] = {/.test(a) ? b / c : d / e;": "return / *[ /'] = {/.test(a)?b/c:d/e;",
    "f(\n{\na,\nb,\n},\n[\nc,\n],\n);": "f({a,b},[c]);",
    'const f = (a) =>\na\n? `\n(`\n: /"/;\n': 'const f=(a)=>a?`\n(`:/"/;',
    "a = {}\nb = c()\n++d": "a={}\nb=c()\n++d",
    "{ while (a); }\n{ b = 1; }": "{while(a);}{b=1}",
    "/** It's {a. */\nf('/** b */', /** @type {C} */ (d), `/* ${e/* ` */}`, /[/*]'/); // /*": (
        "f('/** b */',(d),`/* ${e}`,/[/*]'/);"
    ),
}
"""Script -> the same in fewer bytes."""


@pytest.mark.parametrize("script", CASES)
def test_only_needless_spaces_go(script: str) -> None:
    assert squeezed(script) == CASES[script]
    assert squeezed(CASES[script]) == CASES[script]


def test_blocks_of_comments_go_with_their_lines() -> None:
    script = "a(); // it's\n    /** One\n     ** two. **/\n    b('/* c */',\n    /** @type {D} */ (e));\n/* */\n"
    assert without_blocks(script) == "a(); // it's\n    b('/* c */',\n    (e));\n"
