"""The command `mplicits`, and `python -m mplicits`."""

import os
import sys

from .model.interrupts import end_imports_at_once


def main() -> int:
    """Run the command line and return the exit code. Ctrl-C is handled before cli.py is imported.

    NumPy's BLAS gets one thread: field/evaluate.py has one for each core, and idle threads of BLAS keep the cores busy.
    """
    end_imports_at_once()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from . import cli

    return cli.main()


if __name__ == "__main__":
    sys.exit(main())
