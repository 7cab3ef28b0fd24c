"""A server and a file that no reader may contact: any contact is seen."""

import ctypes
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

IN_OPEN = 0x20
"""inotify's flag of an opened file (inotify(7))."""


class Standby:
    """A listening socket, and a file outside of the folder that is read."""

    def __init__(self, secret: Path) -> None:
        """secret: the file; it is made."""
        self.secret = secret
        secret.write_bytes(b"v 0 0 0\n" * 100)
        self.server = socket.create_server(("127.0.0.1", 0))
        self.server.setblocking(False)
        libc = ctypes.CDLL(None, use_errno=True)
        self.watch = libc.inotify_init1(os.O_NONBLOCK)
        assert libc.inotify_add_watch(self.watch, os.fsencode(secret), IN_OPEN) >= 0, os.strerror(ctypes.get_errno())

    def names(self) -> list[bytes]:
        """Return names of the server and the file, as a file may name them."""
        port = self.server.getsockname()[1]
        path = os.fsencode(self.secret)
        return [f"http://127.0.0.1:{port}/a".encode(), b"file://" + path, path, b"../" + path.split(b"/")[-1]]

    def contacts(self) -> list[str]:
        """Return what was contacted since the last call."""
        found = []
        try:
            self.server.accept()[0].close()
            found.append("the server")
        except BlockingIOError:
            pass
        try:
            os.read(self.watch, 4096)
            found.append("the file")
        except BlockingIOError:
            pass
        return found


@contextmanager
def standby(secret: Path) -> Iterator[Standby]:
    """Let a server and a file stand by."""
    made = Standby(secret)
    try:
        yield made
    finally:
        made.server.close()
        os.close(made.watch)
