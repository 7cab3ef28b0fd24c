"""The endings of mesh files."""

SUFFIXES = (".ply", ".obj", ".stl", ".glb", ".gltf", ".off", ".3mf")
"""In lower case."""
