"""What the processes of a match take: those that a process has started, and those that they have started."""

from __future__ import annotations

import contextlib

import psutil

MB = 2**20


def rss_mb(pid: int) -> int:
    """Return the resident memory of a process and of all below it; pages that they share count for each."""
    try:
        root = psutil.Process(pid)
        family = [root, *root.children(recursive=True)]
    except psutil.NoSuchProcess:
        return 0
    total = 0
    for process in family:
        with contextlib.suppress(psutil.NoSuchProcess):
            total += process.memory_info().rss
    return total // MB


def machine_mb() -> int:
    """Return the memory of this machine."""
    return int(psutil.virtual_memory().total) // MB
