"""The wait policy of PyTorch's threads."""

import os


def prepare_openmp() -> None:
    """Let the threads of GNU OpenMP wait actively for microseconds, not milliseconds; call it before importing PyTorch.

    Beside other programs, a thread that waits actively for longer keeps another thread of the step from its core.
    """
    os.environ.setdefault("GOMP_SPINCOUNT", "1000")
