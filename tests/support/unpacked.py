"""Reads a packed page (web/document.py) in Python."""

import base64
import re
import zlib

from mplicits.web.base124 import GROUP, HELD, SKIPPED


def bytes_of(text: str) -> bytes:
    """Decode base124()."""
    data = b""
    for at in range(0, len(text), GROUP):
        group, value = text[at : at + GROUP], 0
        for code in map(ord, group):
            value = 124 * value + code - sum(skipped < code for skipped in SKIPPED)
        data += value.to_bytes(HELD * len(group) // GROUP)
    return data


def tiny_script(page: str) -> str:
    """Return the script in a tiny page."""
    found = re.search(r"<script type=x>(.*?)</script>", page, re.DOTALL)
    assert found is not None
    return zlib.decompress(bytes_of(found[1]), -zlib.MAX_WBITS).partition(b"\0")[0].decode()


def unpacked(page: str) -> str:
    """Return the HTML in a packed page."""
    found = re.search(r'id="packed">(.*?)</script>', page, re.DOTALL)
    poster = re.search(r'<img id="poster"[^>]* src="([^"]*)"', page)
    assert found is not None
    assert poster is not None
    data = zlib.decompress(bytes_of(found[1]), -zlib.MAX_WBITS)
    html, _, rest = data.partition(b"\0")

    def part(mark: re.Match[str]) -> str:
        if mark[1] == "p":
            return poster[1]
        at, count = map(int, mark[2].split(","))
        held = rest[at : at + count]
        return held.decode() if mark[1] == "t" else base64.b64encode(held).decode()

    return re.sub(r"\x01(\w)([\d,]*)\x01", part, html.decode())
