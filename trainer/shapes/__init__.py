"""What can be learnt: meshes, point clouds, images and the built-in shape."""
