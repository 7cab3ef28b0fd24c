"""Draws pictures with OpenGL: contexts, the camera, ray-traced models, and triangle meshes."""
