"""Prints ops and weights as text in C-like languages."""
