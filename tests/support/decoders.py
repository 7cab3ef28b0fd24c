"""Decoders that do what damaged files make native ones do."""

import os
import time
from importlib import import_module

import numpy as np
from numpy.typing import NDArray

from mplicits.model.errors import UserError
from mplicits.readers.child_process import one_more_file
from mplicits.readers.frames import Arrays


def twice(values: NDArray[np.float64], text: str) -> Arrays:
    return {text: 2 * values, "process": np.array(os.getpid())}


def crash() -> Arrays:
    os.abort()


def sleep() -> Arrays:
    time.sleep(60)
    return {}


def hog() -> Arrays:
    return {"ones": np.ones(1 << 27)}


def much() -> Arrays:
    """Return more than half of what a budget of 100 MB allows."""
    return {"zeros": np.zeros(60_000_000, np.uint8)}


def objects() -> Arrays:
    return {"objects": np.array([{}], object)}


def printing() -> Arrays:
    os.write(1, b"a library's remark")
    return {"ones": np.ones(3)}


def refuse() -> Arrays:
    raise UserError("it is empty")


def fail() -> Arrays:
    raise RuntimeError("code -2\nand more")


def lack() -> Arrays:
    import_module("no_such_package")
    return {}


def open_two(path: str) -> Arrays:
    with one_more_file(), open(path, "rb"), open(path, "rb"):
        return {}
