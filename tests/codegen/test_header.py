"""The header line of generated texts states their origin, and a damaged header line is refused."""

import json
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

from mplicits.bake.registry import TARGETS
from mplicits.codegen.targets import glsl330
from mplicits.codegen.targets.header import read_header
from mplicits.codegen.targets.read_shader import read_shader
from mplicits.codegen.targets.uniforms import SHADINGS, UNIFORMS
from mplicits.glsl import read
from mplicits.model.errors import UserError
from support.random_model import random_model

NAME = 'a "name" */??/\n\u2028</script>\\'


@pytest.mark.parametrize("target", ["glsl330", "glsl300es", "shadertoy", "cuda"])
def test_every_text_begins_with_the_facts_of_its_model(target: str) -> None:
    text = TARGETS[target](random_model((16, 1), (12, 2), name=NAME))
    facts = read_header(text)
    assert (facts["target"], facts["name"], facts["levels"]) == (target, NAME, ["16x1", "12x2"])
    assert len(facts["sha256"]) == 12
    (line,) = (line for line in text.splitlines() if line.startswith("// {"))
    assert line.isascii()
    assert not line.endswith("\\")


@pytest.mark.parametrize(("storage", "textured"), [("literal", False), ("texture", True)])
def test_a_baked_shader_is_read_back_unchanged(storage: str, textured: bool) -> None:
    model = random_model((16, 1), (24, 2), texture=(8, 1) if textured else None, name=NAME)
    shader, text = glsl330.bake(model, storage), glsl330.standalone(model, storage)
    read_back, name, _ = read_shader(text)
    assert (name, read_back.text) == (NAME, text)
    assert read_back.facts() == shader.facts()
    assert read_back.textured == textured
    if shader.weights is None:
        assert read_back.weights is None
    else:
        np.testing.assert_array_equal(read_back.weights, shader.weights)


@cache
def small_text() -> str:
    return glsl330.standalone(random_model((4, 1), (4, 0)))


def changed(change: Callable[[dict[str, Any]], object]) -> str:
    """Change the facts in the header of a shader."""
    text = small_text()
    line = next(line for line in text.splitlines() if line.startswith("// {"))
    facts = json.loads(line[3:])
    change(facts)
    return text.replace(line, "// " + json.dumps(facts))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda facts: facts.pop("mplicits"), "no header line"),
        (lambda facts: facts.update(target="glsl300es"), "another target"),
        (lambda facts: facts.pop("deltas"), "damaged"),
        (lambda facts: facts.update(deltas=[]), "damaged"),
        (lambda facts: facts.update(deltas="0.1"), "damaged"),
        (lambda facts: facts.update(iterations=[20]), "damaged"),
        (lambda facts: facts.update(iterations=[20, 2.5]), "damaged"),
        (lambda facts: facts.update(iterations=[20, True]), "damaged"),
        (lambda facts: facts.update(value_loops=[0, -1]), "damaged"),
        (lambda facts: facts.update(deltas=[0.1, float("nan")]), "damaged"),
        (lambda facts: facts.update(texture_loops=None), "damaged"),
    ],
)
def test_a_damaged_header_is_refused(change: Callable[[dict[str, Any]], object], message: str) -> None:
    with pytest.raises(UserError, match=message):
        read_shader(changed(change))


@pytest.mark.parametrize("text", ["", "#version 330\nvoid main() {}\n", "// {not json\n", "// [1]\n", "// {}\n"])
def test_a_foreign_shader_is_refused(text: str) -> None:
    with pytest.raises(UserError, match="no header line"):
        read_shader(text)


def test_missing_or_damaged_weights_are_refused() -> None:
    text = glsl330.standalone(random_model((4, 1)), "texture")
    with pytest.raises(UserError, match="missing"):
        read_shader(text[: text.index("\n// weights: ")])
    with pytest.raises(UserError, match="damaged"):
        read_shader(text[:-20])


def test_glsl_declares_all_uniforms_and_shadings() -> None:
    text = small_text()
    for uniform in UNIFORMS:
        assert f"uniform {uniform.type} {uniform.declared} = " in text, uniform.name
    for value, name in enumerate(SHADINGS):
        assert f"const int SHADE_{name.upper()} = {value};\n" in read("shadings.glsl")
