"""The command `mplicits`, and `python -m mplicits`."""

import sys

from .model.interrupts import end_imports_at_once


def main() -> int:
    """Run the command line, and return the exit code. The front door is loaded only when Ctrl-C is seen to."""
    end_imports_at_once()
    from . import cli

    return cli.main()


if __name__ == "__main__":
    sys.exit(main())
