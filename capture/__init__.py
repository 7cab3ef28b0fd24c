"""Pictures become shapes to train on: a depth map becomes an oriented, coloured point cloud."""
