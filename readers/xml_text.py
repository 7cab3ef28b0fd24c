"""Refuses XML that could make its parser open a file or a connection, or grow without end."""

import re

from ..model.errors import UserError

ENCODING = re.compile(rb"""encoding\s*=\s*["']([^"']*)""")
KNOWN = re.compile(rb"(?i)utf-?(8|16|32)(le|be)?|utf-?(16|32)-?(le|be)|(us-)?ascii|iso-8859-\d+|windows-125\d")
"""Encodings in which markup is bytes of ASCII, once the zeros of wide characters are gone."""
MARKS = (b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff")
DECLARATION = re.compile(rb"<!(?i:doctype|entity)")
SCHEMA = re.compile(rb"(?i:schemalocation)")
"""End of the names of attributes that name a schema, which a parser that validates fetches."""


def refuse_entities(xml: bytes, *, schemas: bool = True) -> None:
    """Raise UserError for XML with a document type or an entity, or in an encoding that could hide one.

    No format of shapes has them. All text counts, comments too: parsers need not agree on where a comment ends.
    schemas: whether it may name the places of schemas, which is harmless where its parser does not validate.
    """
    text = xml.replace(b"\0", b"") if b"\0" in xml else xml
    for mark in MARKS:
        text = text.removeprefix(mark)
    start = text.lstrip()
    if start and not start.startswith(b"<"):
        raise UserError("its XML is damaged, or in an unknown encoding; UTF-8 is needed")
    if start.startswith(b"<?xml"):
        named = ENCODING.search(start, 0, max(start.find(b"?>"), 0))
        if named and not KNOWN.fullmatch(named[1]):
            raise UserError("its XML is in an unknown encoding; UTF-8 is needed")
    if found := DECLARATION.search(text):
        raise UserError(f"its XML has a {found[0].decode().upper()}, which may name other files; write it without")
    if not schemas and SCHEMA.search(text):
        raise UserError("its XML has a schemaLocation, which may name other files; write it without")
