"""How ops and weights become text in C-like languages."""
