"""Trains the shapes of a folder, and writes a table and a page of the models."""
