"""The verb `report`."""

from dataclasses import dataclass
from pathlib import Path

from ..model.gallery import model_help, model_path
from ..model.options import Options, argument, option
from ..model.references import follow_option
from ..model.verb import Verb, force_option, output_option


@dataclass(frozen=True)
class ReportCommand(Options):
    """Command line of `report`."""

    model: Path = argument("M", model_help(), model_path)
    output: Path | None = output_option("report.html", "the page (default: the model's name, .html, in this folder)")
    force: bool = force_option()
    shape: Path | None = option(
        None, "mesh of the ground truth: the page shows the error of the surface", metavar="SHAPE"
    )
    log: Path | None = option(None, "log that `train --log` wrote: the page shows its curves", metavar="FILE.jsonl")
    follow: bool = follow_option()


def _report(command: ReportCommand) -> None:
    """Write the page. Raises UserError."""
    from ..model.files import check_writable, show, write_whole
    from ..model.kinds import REPORT
    from ..model.model_file import load
    from .page import report

    output = command.output or Path(f"{command.model.stem}.html")
    reads = [command.model, *(path for path in (command.shape, command.log) if path is not None)]
    check_writable(output, reads, kind=REPORT, force=command.force)
    text = report(load(command.model), command.shape, command.log, follow=command.follow)
    write_whole(output, text)
    print(f"{show(output)}: {len(text.encode()):,} bytes")


VERBS = (
    Verb(
        "report",
        "one page about a model and its training: curves, pictures, errors, bytes",
        ReportCommand,
        "report spot --shape spot.obj --log spot.jsonl -o report.html",
        _report,
        "mesh",
    ),
)
