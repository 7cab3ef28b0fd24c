"""Pictures become shapes: a depth map an oriented, coloured point cloud, photographs with cameras a model."""
