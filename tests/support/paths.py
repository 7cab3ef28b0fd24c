"""Paths of the files that tests read."""

import os
from pathlib import Path

TESTS = Path(__file__).parent.parent
ROOT = TESTS.parent
"""The checkout, which is the package `mplicits`."""
GOLDEN = TESTS / "golden"
"""Committed pictures and shader texts; only --update-golden writes there."""
DEMO = TESTS / "data" / "demo.safetensors"
"""A small trained and textured model."""
DATA = Path(os.environ.get("MPLICITS_DATA", ROOT.parent / "shared" / "data"))
"""Meshes and scans that are not part of the project; tests that need one skip where it is missing."""
CASES = DATA.parent / "cases"
"""Files that people have and that go wrong elsewhere, with what is right in their README; not part of the project."""
