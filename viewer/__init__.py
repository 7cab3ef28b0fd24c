"""GL contexts, the renderer, the camera, the window. Imports no torch."""
