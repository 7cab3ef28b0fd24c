"""The headless Chromium of pack_browser.py, driven through a pipe. Standard library only."""

import base64
import io
import json
import os
import select
import subprocess
import tarfile
import threading
import time
from pathlib import Path
from typing import Any

PACK = Path(__file__).parents[1] / "out" / "browser"
"""What pack_browser.py gathers."""
BROWSER, SHELL, FONTS_FILE = "browser", "chromium-headless-shell", "fonts.conf"
FLAGS: tuple[str, ...] = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu-watchdog",
    "--ignore-gpu-blocklist",
    "--enable-unsafe-webgpu",
)
FLAGS += ("--disable-dev-shm-usage", "--hide-scrollbars", "--force-device-scale-factor=1", "--remote-debugging-pipe")
TO_PIPE = 'exec "$@" 3<&0 4>&1 0</dev/null 1>/dev/null'
"""Chromium takes questions from file 3, and answers to file 4."""
LOG_LINES = 200
"""Lines of Chromium's log that are printed: a GPU that fails can write thousands in a second."""
PATIENCE = 30
"""Seconds that an answer may take."""


def unpack(folder: Path) -> Path:
    """Unpack the browser into a folder, unless it is there. Returns its program."""
    program = folder / BROWSER / SHELL
    if not program.exists():
        parts = sorted(PACK.glob("*/part"), key=lambda part: int(part.parent.name))
        with tarfile.open(fileobj=io.BytesIO(b"".join(part.read_bytes() for part in parts)), mode="r:xz") as archive:
            archive.extractall(folder, filter="data")
    return program


class BrowserError(Exception):
    """The browser does not answer, or answers with an error."""


class Browser:
    """A running Chromium with one page. A context manager."""

    def __init__(self, program: Path, flags: tuple[str, ...], profile: Path, environment: dict[str, str]) -> None:
        """Start it. flags: more than FLAGS. profile: a new folder. environment: more than the process's own."""
        profile.mkdir(parents=True)
        variables = os.environ | {"HOME": str(profile), "XDG_CACHE_HOME": str(profile)} | environment
        variables["FONTCONFIG_FILE"] = str(program.parent / FONTS_FILE)
        libraries = [str(program.parent / "lib"), os.environ.get("LD_LIBRARY_PATH", "")]
        variables["LD_LIBRARY_PATH"] = os.pathsep.join(filter(None, libraries))
        command = (str(program), *FLAGS, *flags, f"--user-data-dir={profile}")
        self._process = subprocess.Popen(
            ("sh", "-c", TO_PIPE, "sh", *command),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=variables,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._to, self._from = self._process.stdin.fileno(), self._process.stdout.fileno()
        self._read, self._asked, self._session = b"", 0, ""
        threading.Thread(target=_print_log, args=(self._process,), daemon=True).start()

    def __enter__(self) -> "Browser":
        try:
            target = self.call("Target.createTarget", url="about:blank")["targetId"]
            attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
            self._session = attached["sessionId"]
            self.call("Page.enable")
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()

    def call(self, method: str, patience: float = PATIENCE, **parameters: Any) -> Any:
        """Call a method of the DevTools protocol, and return its result."""
        self._asked += 1
        message = {"id": self._asked, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        data, end = json.dumps(message).encode() + b"\0", time.monotonic() + patience
        try:
            while data:
                data = data[os.write(self._to, data) :]
        except BrokenPipeError as error:
            raise BrowserError(f"{method}: the browser has ended") from error
        while True:
            while b"\0" not in self._read:
                ready = select.select([self._from], [], [], max(0, end - time.monotonic()))[0]
                data = os.read(self._from, 1 << 20) if ready else b""
                if not data:
                    raise BrowserError(
                        f"{method}: {'the browser has ended' if ready else f'no answer in {patience} s'}"
                    )
                self._read += data
            line, _, self._read = self._read.partition(b"\0")
            answer = json.loads(line)
            if answer.get("id") == self._asked:
                if "error" in answer:
                    raise BrowserError(f"{method}: {answer['error']['message']}")
                return answer["result"]

    def value(self, expression: str, patience: float = PATIENCE) -> Any:
        """Return the value of a JavaScript expression, or what its promise resolves to."""
        options = {"expression": expression, "awaitPromise": True, "returnByValue": True}
        answer = self.call("Runtime.evaluate", patience, **options)
        if "exceptionDetails" in answer:
            raise BrowserError(str(answer["exceptionDetails"].get("exception", {}).get("description"))[:300])
        return answer["result"].get("value")

    def until(self, condition: str, seconds: float) -> bool:
        """Wait until a JavaScript expression is true. Returns whether it is within some seconds."""
        end = time.monotonic() + seconds
        while not (found := bool(self.value(condition))) and time.monotonic() < end:
            time.sleep(0.05)
        return found

    def open(self, url: str, size: tuple[int, int], script: str = "") -> None:
        """Open a page. size: of the window, pixels. script: JavaScript that runs before the page's own."""
        width, height = size
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        added = self.call("Page.addScriptToEvaluateOnNewDocument", source=script)
        self.call("Page.navigate", url=url)
        self.until(f"location.href.startsWith({json.dumps(url)})", PATIENCE)
        self.call("Page.removeScriptToEvaluateOnNewDocument", identifier=added["identifier"])

    def picture(self, path: Path) -> None:
        """Write what the window shows as a PNG; print why where that fails."""
        try:
            path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))
        except BrowserError as error:
            print(error, flush=True)


def _print_log(process: subprocess.Popen[bytes]) -> None:
    """Print the first lines of a process's log, and read it to its end."""
    for number, line in enumerate(process.stderr or ()):
        if number < LOG_LINES:
            print(line.decode("utf-8", "replace").rstrip()[:300], flush=True)
