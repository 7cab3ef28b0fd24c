"""The Content-Security-Policy of a page allows its scripts alone, by the hashes of their texts."""

import base64
import hashlib


def hash_of(script: str) -> str:
    """Return the source that allows a script with this text."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
