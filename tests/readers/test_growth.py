"""The time of readers grows with the size of their files: measured at n and at 10 n, among the slow tests."""

import gc
import time
from pathlib import Path

import pytest

from mplicits.readers.read import read_shape
from support.growing_files import FILES

MOST = 12.0  # times as long for ten times as much
FLOOR = 0.2  # seconds that are not compared


def seconds(path: Path) -> float:
    gc.collect()  # what earlier files left
    began = time.process_time()
    read_shape(path)
    return time.process_time() - began


@pytest.mark.slow
@pytest.mark.parametrize("name", FILES)
def test_ten_times_the_file_takes_at_most_twelve_times_as_long(name: str, tmp_path: Path) -> None:
    write, count = FILES[name]
    small = min(seconds(write(tmp_path, count)) for _ in range(3))
    large = min(seconds(write(tmp_path, 10 * count)) for _ in range(2))
    print(f"{name}: {small:.3f} s at {count:,}, {large:.3f} s at {10 * count:,}")
    assert large <= MOST * max(small, FLOOR)
