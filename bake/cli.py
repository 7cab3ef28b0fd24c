"""The verbs `info` and `bake`."""

import json
import sys
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from pathlib import Path

from ..codegen.targets.uniforms import OPENING_SHADES
from ..model.gallery import model_help, model_path
from ..model.verb import Verb, output_arguments
from .registry import DEFAULT, TARGETS


def _info_arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `info` to a parser."""
    parser.add_argument("model", type=model_path, metavar="M", help=model_help())
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def _info(arguments: Namespace) -> None:
    """Run `mplicits info`: print what is known of a model. Raises UserError."""
    from ..model.model_file import load
    from .description import describe
    from .facts import model_facts

    facts = model_facts(load(arguments.model))
    if arguments.json:
        print(json.dumps(facts, indent=2))
        return
    print("\n".join(describe(facts)))


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
    alone = ", ".join(name for name, target in TARGETS.items() if target.alone)
    parser.add_argument("--name", help=f"name of the function ({alone}; default: made of the model's name)")
    parser.add_argument(
        "--space",
        choices=("model", "input"),
        help=f"where the function takes points ({alone}): where the shape fits the unit sphere, or as its file has it "
        "(default: model)",
    )
    opening = ", ".join(name for name, target in TARGETS.items() if target.opens)
    parser.add_argument(
        "--shade",
        choices=OPENING_SHADES,
        help=f"what the text opens in ({opening}; default: {OPENING_SHADES[0]}, but phong in short texts of shadertoy)",
    )


def _digits(text: str) -> int:
    """Read the argument of --digits. Raises ArgumentTypeError."""
    if not text.isdecimal() or int(text) > 9:
        raise ArgumentTypeError(f"{text!r} is not a number of decimals from 0 to 9")
    return int(text)


def _bake(arguments: Namespace) -> None:
    """Run `mplicits bake`: write a model as shader source. Raises UserError."""
    from ..codegen.targets.header import read_header
    from ..model.errors import UserError
    from ..model.files import check_writable, show, write_whole
    from ..model.kinds import GENERATED
    from ..model.model_file import load
    from .bake import bake

    target = arguments.target
    if target not in TARGETS:
        raise UserError(f"--target {show(target)}: there is {', '.join(TARGETS)}")
    model = load(arguments.model)
    output = arguments.output or Path(arguments.model.stem + TARGETS[target].suffix)
    check_writable(output, [arguments.model], kind=GENERATED, force=arguments.force)
    baked = bake(
        model,
        target,
        arguments.storage,
        arguments.digits,
        arguments.precision,
        arguments.name,
        arguments.space,
        arguments.shade,
    )
    if baked.rounding is not None:
        largest, mean = baked.rounding
        print(
            f"float16: the distance near the surface is off by {largest:.1e} at most, {mean:.1e} on average "
            "(the shape has radius 1)",
            file=sys.stderr,
        )
    write_whole(output, baked.text)
    print(f"{show(output)}: {target}, {len(baked.text.encode()):,} bytes", file=sys.stderr)
    if target == "shadertoy":
        _print_error(read_header(baked.text).get("error"))


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
