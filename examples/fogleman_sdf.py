"""A model as a distance function of fogleman/sdf (pip: sdf-fork): cut open by a box, and saved as an STL."""

import sys

from sdf import X, box, sdf3

import mplicits


@sdf3
def neural(name):
    """Return the field of a model, which takes points (N, 3) and gives distances, as that library asks for."""
    return mplicits.load(name).sdf


f = neural("spot") - box(2).translate(X)
f.save(sys.argv[1] if len(sys.argv) > 1 else "half.stl", samples=2**16, bounds=((-1, -1, -1), (1, 1, 1)), workers=1)
