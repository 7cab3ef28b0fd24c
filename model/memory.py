"""Free memory, so that what does not fit is refused before the machine swaps."""

from pathlib import Path

from .errors import UserError

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

CGROUP = Path("/sys/fs/cgroup")
"""Folder with the memory limits of a container or a systemd service."""
BUDGET = 2 << 30
"""Bytes that reading a file may take, whatever the file says."""
RATIO = 100
"""Further bytes for each byte of the file: 2 bytes a point in LAZ become some 150 of positions and colors."""


def allowed(size: int) -> int:
    """Return the bytes of memory that a file of `size` bytes may take."""
    return BUDGET + RATIO * size


def check_claim(needed: float, what: str, size: int = 0) -> None:
    """Raise UserError if what a file says it holds takes more memory than is allowed. Ask before allocating it.

    needed: bytes. what: for the message, such as "1,000,000,000 points". size: bytes of the file, if they are known.
    """
    if needed > allowed(size):
        raise UserError(
            f"{what} would take {needed / 1e9:.3g} GB of memory; {allowed(size) / 1e9:.3g} GB are allowed for a file "
            "of its size; if it is not damaged, split it"
        )


def check_memory(needed: float, what: str, advice: str) -> None:
    """Raise UserError if fewer than `needed` bytes are free: "WHAT needs some 3 GB of memory, ...; ADVICE"."""
    free = free_memory()
    if needed > free:
        raise UserError(
            f"{what} needs some {needed / 1e9:.2g} GB of memory, and {free / 1e9:.2g} GB are free; {advice}"
        )


def free_memory() -> float:
    """Return the bytes that this process may still allocate: the least that machine, container and ulimit allow.

    Infinity where the system tells none of them.
    """
    bounds = [float("inf")]
    taken = 0
    try:
        lines = dict(line.split(":", 1) for line in Path("/proc/meminfo").read_text().splitlines())
        bounds.append(1024.0 * int(lines["MemAvailable"].split()[0]))
        status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
        taken = 1024 * int(status["VmSize"].split()[0])
    except (OSError, KeyError, ValueError):  # not Linux
        pass
    if resource is not None and (limit := resource.getrlimit(resource.RLIMIT_AS)[0]) != resource.RLIM_INFINITY:
        bounds.append(float(limit - taken))
    try:
        most = (CGROUP / "memory.max").read_text().strip()
        if most != "max":
            # The page cache counts in memory.current, but the kernel frees it on demand: subtract "anon" alone.
            used = dict(line.split() for line in (CGROUP / "memory.stat").read_text().splitlines())["anon"]
            bounds.append(float(int(most) - int(used)))
    except (OSError, KeyError, ValueError):  # no such limit
        pass
    return max(0.0, min(bounds))
