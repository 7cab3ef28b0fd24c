"""The command `mplicits`, and `python -m mplicits`."""

import sys

from .model.interrupts import end_imports_at_once


def main() -> int:
    """Run the command line and return the exit code. Ctrl-C is handled before cli.py is imported."""
    end_imports_at_once()
    from . import cli

    return cli.main()


if __name__ == "__main__":
    sys.exit(main())
