"""Folders of shapes, each of which becomes a model."""
