"""What a room's cli.py declares: a verb of the command line."""

from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from dataclasses import dataclass

MODEL_HELP = "model file (.safetensors), or a name of the gallery: spot, bob"


@dataclass(frozen=True)
class Verb:
    """`mplicits NAME`. `arguments` fills the parser; `run` does the work and imports what it needs only then."""

    name: str
    help: str
    arguments: Callable[[ArgumentParser], None]
    run: Callable[[Namespace], None]
