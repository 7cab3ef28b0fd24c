"""Rewrites of a shader that mean the same give the same picture: neither the text nor the driver hangs on chance."""

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mplicits.codegen.targets import glsl330
from mplicits.codegen.targets.shader import Shader
from mplicits.viewer.draw.camera import Camera
from mplicits.viewer.draw.context import Context
from mplicits.viewer.draw.renderer import Renderer
from mplicits.viewer.draw.supersampling import Image
from support.random_model import random_model

pytestmark = pytest.mark.slow

SIZE = (32, 24)
Rewrite = Callable[[str], str]


def around_main(body: str, before: str = "") -> Rewrite:
    """Call what was main from another main, whose body is `body`."""
    return lambda text: f"{text.replace('void main()', 'void inner()')}\n{before}\nvoid main() {{ {body} }}\n"


def by(pattern: str, replacement: str) -> Rewrite:
    """Replace what matches outside of the lines of the preprocessor and of comments."""

    def rewrite(text: str) -> str:
        lines = text.split("\n")
        changed = [line if re.match(r"\s*(#|//)", line) else re.sub(pattern, replacement, line) for line in lines]
        assert changed != lines, pattern
        return "\n".join(changed)

    return rewrite


REWRITES: dict[str, Rewrite] = {
    "a loop of one round": around_main("for (int once = 0; once < 1; once++) inner();"),
    "a loop that ends by itself": around_main("do { inner(); } while (false);"),
    "a loop that is left": around_main("while (true) { inner(); break; }"),
    "a switch of one case": around_main("switch (1) { case 1: inner(); break; default: discard; }"),
    "a dead branch on a uniform": around_main("if (resolution.x < 0.0) { color = vec4(0.5); return; } inner();"),
    "a dead discard": around_main("if (resolution.x < 0.0) discard; inner();"),
    "a branch that is always taken": around_main("if (resolution.x > 0.0) inner(); else color = vec4(0.5);"),
    "a call through three functions": around_main("c();", "void a() { inner(); } void b() { a(); } void c() { b(); }"),
    "a result that is copied": around_main("inner(); vec4 kept = color; color = vec4(0.5); color = kept;"),
    "a result times one": around_main("inner(); color *= float(resolution.x > 0.0);"),
    "a function that nobody calls": around_main("inner();", "float unused(vec3 p) { return length(p) - 1.0; }"),
    "a uniform that nobody reads": around_main("inner();", "uniform float unread;"),
    "values in brackets": by(r"return ([^;]+);", r"return (\1);"),
    "values chosen from equals": by(r"return ([^;]+);", r"return true ? \1 : \1;"),
    "statements in blocks": by(r"return ([^;]+);", r"{ return \1; }"),
    "two as a sum": by(r"(?<![\w.])2\.0(?![\w.])", "(1.0 + 1.0)"),
    "a half as a quotient": by(r"(?<![\w.])0\.5(?![\w.])", "(1.0 / 2.0)"),
    "one as a difference": by(r"(?<![\w.])1\.0(?![\w.])", "(3.0 - 2.0)"),
    "counting otherwise": by(r"\+\+(\w+)\)", r"\1 += 1)"),
    "comments everywhere": by(r";", r"; /* so */"),
    "a renamed function, field": by(r"\bfield\b", "field_by_another_name"),
    "a renamed function, albedo": by(r"\balbedo\b", "albedo_by_another_name"),
}


@pytest.fixture(scope="module")
def shader() -> Shader:
    return replace(glsl330.bake(random_model((6, 0), (6, 1), texture=(4, 0)), "literal"), passes=None)


def picture(osmesa: Context, shader: Shader) -> Image:
    renderer = Renderer(osmesa, shader)
    image = renderer.render(SIZE, Camera())
    renderer.release()
    return image


@pytest.fixture(scope="module")
def usual(osmesa: Context, shader: Shader) -> Image:
    image = picture(osmesa, shader)
    assert np.ptp(image[..., :3]) > 0.3, "there is something to see"
    return image


@pytest.mark.parametrize("name", REWRITES)
def test_a_rewrite_gives_the_same_picture(osmesa: Context, shader: Shader, usual: Image, name: str) -> None:
    text = REWRITES[name](shader.text)
    assert text != shader.text
    np.testing.assert_allclose(picture(osmesa, replace(shader, text=text)), usual, rtol=0, atol=2e-6)
