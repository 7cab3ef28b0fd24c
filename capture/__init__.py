"""Turns pictures into something to train on (a depth map), or into a model (photographs with cameras)."""
