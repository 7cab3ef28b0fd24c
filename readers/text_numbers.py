"""Reads the numbers of a text."""

import warnings

import numpy as np

from .values import Doubles


def numbers(text: str) -> Doubles:
    """Return the numbers of a text, separated by blanks or line ends. Raises ValueError for another word."""
    if not text.strip():
        return np.empty(0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # NumPy warns of a word in place of a number, and stops there
        try:
            return np.fromstring(text, np.float64, sep=" ")
        except DeprecationWarning:
            raise ValueError("a word in place of a number") from None
