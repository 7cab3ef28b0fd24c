"""A model file, and the log of its training -> one page about it."""
