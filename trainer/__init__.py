"""Mesh or oriented point cloud -> model file. The only room that imports torch."""
