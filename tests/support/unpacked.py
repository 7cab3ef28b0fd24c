"""Reads a packed page (web/packed_page.py) in Python."""

import base64
import re
import zlib


def bytes_of(text: str) -> bytes:
    """Decode base94()."""
    digits = text.replace("\n", "").replace(" ", "<")
    data = b""
    for at in range(0, len(digits), 11):
        value = 0
        for letter in digits[at : at + 11].ljust(11, "~"):
            value = 94 * value + ord(letter) - 33
        data += value.to_bytes(9)
    return data[: 9 * len(digits) // 11]


def unpacked(page: str) -> str:
    """Return the HTML in a packed page."""
    found = re.search(r'id="packed">(.*?)</script>', page, re.DOTALL)
    poster = re.search(r'<img id="poster"[^>]* src="([^"]*)"', page)
    assert found is not None
    assert poster is not None
    data = zlib.decompress(bytes_of(found[1]), -zlib.MAX_WBITS)
    html, _, rest = data.partition(b"\0")
    pieces = iter(re.split(r"\x01(\w+)\x01", html.decode()))
    text = next(pieces)
    for mark, following in zip(pieces, pieces, strict=True):
        if mark == "poster":
            text += poster[1] + following
        else:
            text += base64.b64encode(rest[: int(mark)]).decode() + following
            rest = rest[int(mark) :]
    assert not rest
    return text
