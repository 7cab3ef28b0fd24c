"""The shapes that can be trained on: meshes with images, point clouds, and the built-in shape."""
