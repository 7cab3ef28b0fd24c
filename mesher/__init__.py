"""A model becomes a triangle mesh, and a mesh is compared with its ground truth."""
