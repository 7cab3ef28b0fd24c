"""The web page: `page.py` writes it, and `app/` holds its scripts, its style and its HTML."""
