"""Cut a model open by a box of fogleman/sdf (pip: sdf-fork), and save it as an STL."""

import sys

from sdf import X, box, sdf3

import mplicits


@sdf3
def neural(name):
    """Return a model as a function from points (N, 3) to distances."""
    return mplicits.load(name).sdf


f = neural("spot") - box(2).translate(X)
f.save(sys.argv[1] if len(sys.argv) > 1 else "half.stl", samples=2**16, bounds=((-1, -1, -1), (1, 1, 1)), workers=1)
