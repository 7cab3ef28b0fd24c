"""The verbs `info` and `bake`."""

import json
import sys
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..model.gallery import model_help, model_path
from ..model.verb import Verb, output_arguments
from .targets.registry import DEFAULT, TARGETS, Target

if TYPE_CHECKING:
    from ..model.model import Model


def _info_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `info` to a parser."""
    parser.add_argument("model", type=model_path, metavar="M", help=model_help())
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def _info(arguments: Namespace) -> None:
    """Run `mplicits info`: print what is known of a model. Raises UserError."""
    from ..model.model import load
    from .description import describe

    facts = _facts(load(arguments.model))
    if arguments.json:
        print(json.dumps(facts, indent=2))
        return
    print("\n".join(describe(facts)))


def _facts(model: "Model") -> dict[str, Any]:
    """Collect what `info --json` prints."""
    from ..model.model import shape_of
    from .ir.lower import lower
    from .ir.program import Cost

    program = lower(model)
    levels = []
    total = Cost(0, 0)
    for level, function in zip(model.levels, program.values, strict=True):
        total += program.cost(function)
        levels.append(
            {
                "network": shape_of(level.network),
                "parameters": sum(layer.weight.size + layer.bias.size for layer in level.network),
                "multiply_adds": total.multiply_adds,
                "sines": total.sines,
                "delta": level.delta,
                "iterations": level.iterations,
                "lipschitz": level.lipschitz,
                "step_bound": level.step_bound,
                "band_step_bound": level.band_step_bound,
            }
        )
    return {
        "name": model.name,
        "sha256": program.sha256,
        "parameters": model.parameters(),
        "levels": levels,
        "texture": None if model.texture is None else shape_of(model.texture),
        "inputs": model.inputs,
        "centre": model.centre,
        "scale": model.scale,
        "up": model.up,
        "front": model.front,
        "credit": model.credit,
        "bytes": {name: _size(model, target) for name, target in TARGETS.items()},
        "provenance": model.provenance,
    }


def _size(model: "Model", target: Target) -> int | None:
    """Count the bytes of what a target writes; None where it refuses the model."""
    from ..model.errors import UserError

    try:
        return target.size(model)
    except UserError:
        return None


def _bake_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `bake` to a parser."""
    parser.add_argument("model", type=model_path, metavar="M", help=model_help())
    names = ", ".join(f"{name} (default)" if name == DEFAULT else name for name in TARGETS)
    parser.add_argument("--target", default=DEFAULT, help=f"what to write: {names}")
    output_arguments(parser, "FILE", "file to write (default: M's name and the target's ending)")
    parser.add_argument(
        "--storage",
        default="auto",
        choices=("auto", "literal", "texture", "packed"),
        help="how weights are stored (auto: literals up to 64 wide, a texture above; "
        "shadertoy: packed in the fewest bits that keep the picture)",
    )
    rounding = parser.add_mutually_exclusive_group()
    rounding.add_argument("--digits", type=_digits, metavar="N", help="decimals of the weights (default: all)")
    rounding.add_argument(
        "--precision",
        default="float32",
        choices=("float32", "float16"),
        help="float16 halves the weights of an html page, and prints what that costs",
    )


def _digits(text: str) -> int:
    """Read the argument of --digits. Raises ArgumentTypeError."""
    if not text.isdecimal() or int(text) > 9:
        raise ArgumentTypeError(f"{text!r} is not a number of decimals from 0 to 9")
    return int(text)


def _bake(arguments: Namespace) -> None:
    """Run `mplicits bake`: write a model as shader source. Raises UserError."""
    from ..model.errors import UserError
    from ..model.files import check_writable, show, write_whole
    from ..model.kinds import GENERATED
    from ..model.model import load
    from .reference.rounding import in_float16, rounding_error
    from .targets.header import read_header

    if arguments.target not in TARGETS:
        raise UserError(f"--target {show(arguments.target)}: there is {', '.join(TARGETS)}")
    model = load(arguments.model)
    output = arguments.output or Path(arguments.model.stem + TARGETS[arguments.target].suffix)
    check_writable(output, [arguments.model], kind=GENERATED, force=arguments.force)
    if arguments.precision == "float16":
        exact, model = model, in_float16(model)
        largest, mean = rounding_error(exact, model)
        print(
            f"float16: the distance near the surface is off by {largest:.1e} at most, {mean:.1e} on average "
            "(the shape has radius 1)",
            file=sys.stderr,
        )
    text = TARGETS[arguments.target](model, storage=arguments.storage, digits=arguments.digits)
    write_whole(output, text)
    print(f"{show(output)}: {arguments.target}, {len(text.encode()):,} bytes", file=sys.stderr)
    if arguments.target == "shadertoy":
        _print_error(read_header(text).get("error"))


def _print_error(error: dict[str, float] | None) -> None:
    """Print what rounding the weights of a text cost, as its header says it; nothing where it cost nothing."""
    if error:
        colours = f", colours by {error['colour']:g}/255" if "colour" in error else ""
        print(
            f"weights of few bits: near the surface, distances are off by {error['f']:.1e} (the shape has radius 1), "
            f"normals by {error['degrees']:g} degrees{colours} (root mean square)",
            file=sys.stderr,
        )


VERBS = (
    Verb("info", "levels, parameters, cost and bytes of a model", _info_arguments, "info spot", _info),
    Verb(
        "bake",
        "write a model's weights and the renderer as shader source",
        _bake_arguments,
        "bake spot --target html -o spot.html",
        _bake,
    ),
)
