"""The pages of an E57 file: 1,020 bytes each and their CRC-32C (Castagnoli), the highest byte first (ASTM E2807)."""

import struct

BYTES = 1020
FILE_LENGTH, XML_LENGTH = 16, 32
"""Where the header holds them, as 8 bytes each. The XML part stands at the end."""


def _table() -> list[int]:
    entries = []
    for byte in range(256):
        entry = byte
        for _ in range(8):
            entry = entry >> 1 ^ (0x82F63B78 if entry & 1 else 0)
        entries.append(entry)
    return entries


TABLE = _table()


def checksum(page: bytes) -> bytes:
    """Return the four bytes behind a page."""
    rest = 0xFFFFFFFF
    for byte in page:
        rest = rest >> 8 ^ TABLE[(rest ^ byte) & 0xFF]
    return (rest ^ 0xFFFFFFFF).to_bytes(4, "big")


def without_checksums(file: bytes) -> bytes:
    """Return what the pages of a file hold."""
    return b"".join(file[at : at + BYTES] for at in range(0, len(file), BYTES + 4))


def with_checksums(content: bytes) -> bytes:
    """Return a file of whole pages."""
    pages = [content[at : at + BYTES].ljust(BYTES, b"\0") for at in range(0, len(content), BYTES)]
    return b"".join(page + checksum(page) for page in pages)


def with_lengths(content: bytes, added: int) -> bytes:
    """Correct the lengths in the header of what pages hold. added: bytes by which the XML part grew."""
    changed = bytearray(content)
    if len(content) >= XML_LENGTH + 8:
        struct.pack_into("<Q", changed, FILE_LENGTH, -(-len(content) // BYTES) * (BYTES + 4))
        (length,) = struct.unpack_from("<Q", changed, XML_LENGTH)
        struct.pack_into("<Q", changed, XML_LENGTH, (length + added) % 2**64)
    return bytes(changed)
