"""Measure what the README claims: `python -m bench` runs every measurement, `python -m bench turn bus` some of them.

Each is a module with its own options, see `python -m bench.turn --help`. They take minutes, one after
the other: the figures are most reliable on an otherwise idle machine.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

MEASUREMENTS = (
    "turn", "bus", "simulator_env", "simulator_engine", "simulator_memory", "observe", "abilities", "act",
    "recognition", "macro", "image", "http_client", "recording", "measures", "orphans", "strangers", "clocks",
    "pace", "serve", "scenes", "start", "view",
    "faults", "resume", "soak", "mining", "crowds",
)  # fmt: skip


def main() -> None:
    """Run the measurements that are named, or all."""
    wanted = sys.argv[1:] or MEASUREMENTS
    if unknown := [name for name in wanted if name not in MEASUREMENTS]:
        raise SystemExit(f"there is no measurement {unknown[0]!r}; there are {', '.join(MEASUREMENTS)}")
    for name in wanted:
        print(f"\n== python -m bench.{name}", flush=True)
        subprocess.run([sys.executable, "-m", f"bench.{name}"], check=True, cwd=Path(__file__).parent.parent)


if __name__ == "__main__":
    main()
