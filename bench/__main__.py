"""Measure what docs/measurements.md claims: `python -m bench` runs all, `python -m bench turn bus` some of it.

Each is a module of its own with options of its own, see `python -m bench.turn --help`. They take minutes, one after
the other: on a machine that does nothing else the figures mean most.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

MEASUREMENTS = (
    "turn", "bus", "simulator_env", "simulator_engine", "simulator_memory", "observe", "abilities", "act",
    "recognition", "macro", "image", "http_client", "recording",
)  # fmt: skip


def main() -> None:
    """Runs the measurements that are named, or all."""
    wanted = sys.argv[1:] or MEASUREMENTS
    if unknown := [name for name in wanted if name not in MEASUREMENTS]:
        raise SystemExit(f"there is no measurement {unknown[0]!r}; there are {', '.join(MEASUREMENTS)}")
    for name in wanted:
        print(f"\n== python -m bench.{name}", flush=True)
        subprocess.run([sys.executable, "-m", f"bench.{name}"], check=True, cwd=Path(__file__).parent.parent)


if __name__ == "__main__":
    main()
