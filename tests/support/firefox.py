"""Firefox for the page's tests: on a virtual display, with WebGL2 on llvmpipe, driven over Marionette.

Marionette is Firefox's own remote protocol: each message is its length in bytes, a colon, and JSON. A command is
[0, number, name, parameters], its answer [1, number, error, result].
"""

import json
import os
import socket
import subprocess
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from support import needs

PREFERENCES = {
    "marionette.port": 0,
    "webgl.force-enabled": True,
    "browser.shell.checkDefaultBrowser": False,
    "browser.startup.homepage_override.mstone": "ignore",
    "datareporting.policy.dataSubmissionEnabled": False,
    "toolkit.telemetry.enabled": False,
}
"""Preferences: any free port, WebGL without a GPU, and no first-start windows."""
PATIENCE = 300
"""Timeout of Firefox's start, and of a condition, seconds."""


class Firefox:
    """A running Firefox with one window."""

    def __init__(self, port: int) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)
        self._stream = self._socket.makefile("rb")
        self._read()
        # Firefox never says that a page has loaded which replaces itself before that, as a packed one may.
        self.ask("WebDriver:NewSession", {"pageLoadStrategy": "none"})

    def ask(self, command: str, parameters: dict[str, Any]) -> Any:
        """Return the answer to a command of the protocol. Raises RuntimeError with Firefox's message."""
        text = json.dumps([0, 1, command, parameters])
        self._socket.sendall(f"{len(text)}:{text}".encode())
        _, _, error, result = self._read()
        if error:
            raise RuntimeError(f"{command}: {error['message']}")
        return result

    def load(self, url: str | None = None) -> None:
        """Open an address, or the present one anew, and wait until it has loaded."""
        self.evaluate("void (window.isOld = true)")
        if url is None:
            self.ask("WebDriver:Refresh", {})
        else:
            self.ask("WebDriver:Navigate", {"url": url})
        self.until("!window.isOld && document.readyState === 'complete'")

    def evaluate(self, expression: str) -> Any:
        """Return the value of a JavaScript expression in the page."""
        parameters = {"script": f"return ({expression});", "args": []}
        return self.ask("WebDriver:ExecuteScript", parameters)["value"]

    def until(self, condition: str) -> None:
        """Wait until a JavaScript expression is true, also of a page that still loads.

        Raises TimeoutError with the page's text.
        """
        end, error = time.monotonic() + PATIENCE, ""
        while time.monotonic() < end:
            try:
                if self.evaluate(condition):
                    return
            except RuntimeError as failure:  # a document that has just begun, or ended
                error = str(failure)
            time.sleep(0.2)
        raise TimeoutError(f"{condition} after {PATIENCE} s: {error} {self.evaluate('document.body.innerText')}")

    def _read(self) -> Any:
        length = b""
        while not length.endswith(b":"):
            length += self._stream.read(1)
        return json.loads(self._stream.read(int(length[:-1])))


@contextmanager
def firefox(
    profile: Path, environment: dict[str, str], more: Mapping[str, Any] = {}, printed: Path | None = None
) -> Iterator[Firefox]:
    """Start Firefox with a new profile in an empty folder, to which it also downloads.

    more: further preferences. printed: a file for what it prints. Skips the test if it is not installed.
    """
    path = needs.program("Firefox")
    preferences = PREFERENCES | dict(more) | {"browser.download.folderList": 2, "browser.download.dir": str(profile)}
    lines = [f"user_pref({json.dumps(name)}, {json.dumps(value)});\n" for name, value in preferences.items()]
    (profile / "user.js").write_text("".join(lines))
    command = [path, "--marionette", "--no-remote", "--profile", str(profile), "about:blank"]
    with (printed or Path(os.devnull)).open("a") as output:
        process = subprocess.Popen(command, env=environment, stdout=output, stderr=output)
    try:
        port, end = profile / "MarionetteActivePort", time.monotonic() + PATIENCE
        while not (port.exists() and port.read_text()):
            assert process.poll() is None, "Firefox does not start"
            assert time.monotonic() < end, f"Firefox does not start within {PATIENCE} s"
            time.sleep(0.2)
        yield Firefox(int(port.read_text()))
    finally:
        process.terminate()
        process.wait(PATIENCE)
