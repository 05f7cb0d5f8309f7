"""The memory of a process, as Linux tells it."""

from pathlib import Path


def rss_mb(pid: int | str = "self") -> float:
    """Return the resident memory of a process, in megabytes of 2^20 bytes; of this one if none is given."""
    status = Path(f"/proc/{pid}/status").read_text(encoding="utf-8")
    return int(status.partition("VmRSS:")[2].split()[0]) / 1024
