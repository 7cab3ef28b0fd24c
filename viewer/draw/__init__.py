"""Draws pictures with OpenGL: contexts, the camera, the renderer of a baked shader, the rasteriser of a mesh."""
