"""How much memory there is for a mesh, so that what does not fit is refused before the machine swaps without end."""

import resource
from pathlib import Path

from ..model.errors import UserError

CGROUP = Path("/sys/fs/cgroup")
"""Where a container, or a service of systemd, finds the limits that it runs under."""


def check_memory(needed: float, resolution: int) -> None:
    """Check that so many bytes are free. Raises UserError, which says so of --resolution, where they are not."""
    free = free_memory()
    if needed > free:
        raise UserError(
            f"--resolution {resolution}: this surface needs some {needed / 1e9:.2g} GB of memory, and "
            f"{free / 1e9:.2g} GB are free; take a lower one"
        )


def free_memory() -> float:
    """Return the bytes that this process may still take: the least of what machine, container and ulimit allow."""
    bounds = [float("inf")]
    try:
        lines = dict(line.split(":", 1) for line in Path("/proc/meminfo").read_text().splitlines())
        bounds.append(1024.0 * int(lines["MemAvailable"].split()[0]))
        taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    except (OSError, KeyError, ValueError):  # not Linux
        taken = 0
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY:
        bounds.append(float(limit - taken))
    try:
        most = (CGROUP / "memory.max").read_text().strip()
        if most != "max":
            # Files in the cache count towards memory.current, but give way.
            used = dict(line.split() for line in (CGROUP / "memory.stat").read_text().splitlines())["anon"]
            bounds.append(float(int(most) - int(used)))
    except (OSError, KeyError, ValueError):  # no such limits here
        pass
    return max(0.0, min(bounds))
