"""Free memory, so that what does not fit is refused before the machine swaps."""

from pathlib import Path

from .errors import UserError

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

CGROUP = Path("/sys/fs/cgroup")
"""Folder with the memory limits of a container or a systemd service."""
BUDGET = 2e9
"""Most bytes that a file may claim by numbers in it, beyond what its own bytes account for."""


def check_memory(needed: float, what: str, advice: str) -> None:
    """Raise UserError if fewer than `needed` bytes are free: "WHAT needs some 3 GB of memory, ...; ADVICE"."""
    free = free_memory()
    if needed > free:
        raise UserError(
            f"{what} needs some {needed / 1e9:.2g} GB of memory, and {free / 1e9:.2g} GB are free; {advice}"
        )


def check_claim(claimed: float, what: str) -> None:
    """Raise UserError if a number in a file claims more bytes than `BUDGET`: "WHAT would take 8 GB of memory, ..."."""
    if claimed > BUDGET:
        raise UserError(f"{what} would take {claimed / 1e9:.2g} GB of memory; {BUDGET / 1e9:g} GB are allowed")


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
