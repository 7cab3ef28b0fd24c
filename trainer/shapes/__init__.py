"""Shapes to train on: meshes with images, point clouds, motions, and the demo shape."""
