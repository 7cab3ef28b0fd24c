"""Training: a mesh or an oriented point cloud becomes a model. This is the only room that imports torch."""
