"""What the stages of on_gpu.py share: the pack, the rehearsal, commands."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACK = ROOT / "out" / "gpu"
"""What pack_for_gpu.py gathers."""
REHEARSAL = "MPLICITS_REHEARSAL" in os.environ
"""Whether to run tiny cases on a CPU, with g++ in nvcc's place."""
DEVICE = "cpu" if REHEARSAL else "cuda"
MPLICITS = (sys.executable, "-m", "mplicits")


def run(*command: object, timeout: float | None = None, check: bool = False) -> subprocess.CompletedProcess[str]:
    """Run a command; print its output, and return it with both streams in stdout; 124 is the code after a timeout."""
    words = [str(word) for word in command]
    print("$", *words, flush=True)
    try:
        done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=timeout, check=False)
        code, output = done.returncode, done.stdout
    except subprocess.TimeoutExpired as late:
        code, output = 124, (late.stdout or b"") + f"\nstopped after {timeout} s".encode()
    text = output.decode("utf-8", "replace")
    print(text[-4000:], flush=True)
    if check and code:
        raise SystemExit(f"{words[0]} failed with {code}: {text[-300:]}")
    return subprocess.CompletedProcess(words, code, text)
