"""Renames a program's functions and constants, so that one text can hold several programs."""

from dataclasses import fields, replace
from typing import Any

from .program import Function, Op, Program


def prefixed(program: Program, name: str) -> Program:
    """Return a program in which the names of functions and constants begin with `name` and an underscore."""
    names = {constant: f"{name}_{constant}" for constant in program.constants}

    def op(old: Op) -> Op:
        texts = {entry.name: getattr(old, entry.name) for entry in fields(old)}
        renamed: dict[str, Any] = {key: names[text] for key, text in texts.items() if text in names}
        return replace(old, **renamed)

    def function(old: Function) -> Function:
        return replace(old, name=f"{name}_{old.name}", ops=tuple(op(entry) for entry in old.ops))

    composition = program.composition
    if composition is not None:
        parts = {id(part): prefixed(part, name) for part in composition.programs}
        leaves = tuple(replace(leaf, part=parts.get(id(leaf.part), leaf.part)) for leaf in composition.leaves)
        composition = replace(composition, programs=tuple(parts.values()), leaves=leaves)
    return replace(
        program,
        composition=composition,
        constants={names[key]: constant for key, constant in program.constants.items()},
        values=tuple(map(function, program.values)),
        gradients=tuple(map(function, program.gradients)),
        texture=None if program.texture is None else function(program.texture),
    )
