"""From a model file to a triangle mesh, and how far that mesh is from its ground truth."""
