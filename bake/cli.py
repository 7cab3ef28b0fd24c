"""The verbs `info`, `bake` and `pack`."""

import json
import sys
from dataclasses import dataclass
from pathlib import Path

from ..model.gallery import SUFFIX, model_help, model_path
from ..model.options import argument, option
from ..model.verb import Verb, force_option, output_option
from .options import BakeOptions, InfoOptions, PackOptions
from .registry import TARGETS


@dataclass(frozen=True)
class InfoCommand(InfoOptions):
    """Command line of `info`."""

    model: Path = argument("M", model_help(), model_path)
    json: bool = option(False, "print one JSON object")


def _info(command: InfoCommand) -> None:
    """Print the facts about a model. Raises UserError."""
    from ..model.model_file import load
    from .description import describe
    from .facts import model_facts

    facts = model_facts(load(command.model), sizes=command.sizes)
    print(json.dumps(facts, indent=2) if command.json else "\n".join(describe(facts)))


@dataclass(frozen=True)
class BakeCommand(BakeOptions):
    """Command line of `bake`."""

    model: Path = argument("M", model_help(), model_path)
    force: bool = force_option()


def _bake(command: BakeCommand) -> None:
    """Write a model as shader source. Raises UserError."""
    from ..model.files import check_writable, show, write_whole
    from ..model.kinds import GENERATED
    from ..model.model_file import load
    from .bake import bake

    model = load(command.model)
    output = Path(command.path or command.model.stem + TARGETS[command.target].suffix)
    more = TARGETS[command.target].beside(output)
    for path in (output, *more):
        check_writable(path, [command.model], kind=GENERATED, force=command.force)
    baked, lines = bake(model, command)
    for line in lines:
        print(line, file=sys.stderr)
    for path, text in (more | {output: baked.text}).items():
        write_whole(path, text)
    print(f"{show(output)}: {command.target}, {len(baked.text.encode()):,} bytes", file=sys.stderr)
    if baked.policy is not None:
        print(f"its policy, for a server that sends a header: {baked.policy}", file=sys.stderr)


@dataclass(frozen=True)
class PackCommand(PackOptions):
    """Command line of `pack`."""

    model: Path = argument("M", model_help(), model_path)
    output: Path | None = output_option("M2", "model file (default: M's name, -packed.safetensors, in this folder)")
    force: bool = force_option()


def _pack(command: PackCommand) -> None:
    """Write a model with weights of few bits. Raises UserError."""
    from ..field.pack import packed
    from ..model.bits import read_bits
    from ..model.files import check_writable, show, write_whole
    from ..model.kinds import MODEL
    from ..model.model_file import load, to_bytes
    from .description import describe_packing

    bits = read_bits(command.bits)
    output = command.output or Path(command.model.stem + "-packed" + SUFFIX)
    check_writable(output, [command.model], kind=MODEL, force=command.force)
    result = packed(load(command.model), bits)
    data = to_bytes(result.model)
    write_whole(output, data)
    print(f"{show(output)}: {describe_packing(result, command.model.stat().st_size, len(data))}")


VERBS = (
    Verb("info", "levels, parameters, costs and quality of a model", InfoCommand, "info spot", _info),
    Verb(
        "bake",
        "write a model's weights and the renderer as shader source",
        BakeCommand,
        "bake spot --target html -o spot.html",
        _bake,
    ),
    Verb(
        "pack",
        "round a model's weights to few bits: a file of a fifth of the bytes",
        PackCommand,
        "pack spot -o spot-packed.safetensors",
        _pack,
    ),
)
