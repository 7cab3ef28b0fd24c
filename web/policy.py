"""The Content-Security-Policy of a page allows its scripts alone, by the hashes of their texts."""

import base64
import hashlib
import re

ANY = "'unsafe-inline'"
"""Source that allows every script in a page."""
_SCRIPT = re.compile(r'<script(?: type="module")?>(.*?)</script>', re.DOTALL)
_META = re.compile(r'http-equiv="?Content-Security-Policy"? content="([^"]*)"')


def hash_of(script: str) -> str:
    """Return the source that allows a script with this text."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def hashes(page: str) -> str:
    """Return the sources that allow the scripts in a page: those that run, not those that hold data."""
    return " ".join(dict.fromkeys(hash_of(script[1]) for script in _SCRIPT.finditer(page)))


def policy_of(page: str) -> str | None:
    """Return the policy of a page; None for another text."""
    found = _META.search(page, 0, page.find("</title>")) if page.startswith("<!doctype html>") else None
    return found and found[1]
