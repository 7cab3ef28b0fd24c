"""Reads the files of shapes: a mesh or a point cloud as the file means it, in the coordinates of the file."""
