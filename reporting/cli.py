"""The verb `report` of the command line."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..model.gallery import model_help, model_path
from ..model.verb import Verb, output_arguments


def arguments(parser: ArgumentParser) -> None:
    """Add the arguments of `report`."""
    parser.add_argument("model", type=model_path, metavar="M", help=model_help())
    output_arguments(parser, "report.html", "the page (default: the model's name, .html, in this folder)")
    parser.add_argument(
        "--shape", metavar="SHAPE", type=Path, help="the mesh that is the truth: the page shows how far the surface is"
    )
    parser.add_argument(
        "--log", metavar="FILE.jsonl", type=Path, help="what `train --log` wrote: the page shows its curves"
    )


def run(args: Namespace) -> None:
    """Write the page. Raises UserError."""
    from ..model.files import check_writable, show, write_whole
    from ..model.kinds import REPORT
    from ..model.model_file import load
    from .page import report

    output = args.output or Path(f"{args.model.stem}.html")
    reads = [args.model, *(path for path in (args.shape, args.log) if path is not None)]
    check_writable(output, reads, kind=REPORT, force=args.force)
    text = report(load(args.model), args.shape, args.log)
    write_whole(output, text)
    print(f"{show(output)}: {len(text.encode()):,} bytes")


VERBS = (
    Verb(
        "report",
        "one page about a model and its training: curves, pictures, errors, bytes",
        arguments,
        "report spot --shape spot.obj --log spot.jsonl -o report.html",
        run,
        extra="mesh",
    ),
)
