"""Run measurements, each in a process of its own, and have their figures.

Below it are the modules of `bench` themselves: `--json` prints what they found, `measures` makes figures of that.
"""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from typing import TYPE_CHECKING, Final

from bench.paths import ROOT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bench.figures import Figure

KEPT: Final = (
    "yardstick", "turn", "bus", "simulator_engine", "engines", "simulator_env", "floors", "start", "observe", "act",
    "abilities", "games_per_hour", "env", "openenv",
)  # fmt: skip
"""The measurements whose figures are kept: they have `--json` and `measures`."""
PRINTED: Final = (
    "simulator_memory", "recognition", "macro", "image", "http_client", "recording", "measures",
    "orphans", "strangers", "clocks", "pace", "serve", "scenes", "view", "faults", "resume", "soak", "mining", "crowds",
    "doors", "money",
)  # fmt: skip
"""Those that print a table and nothing else."""


def show(name: str, options: Sequence[str] = ()) -> None:
    """Run a measurement, which prints what it found.

    Raises:
        subprocess.CalledProcessError: it failed.
    """
    subprocess.run(_command(name, options), check=True, cwd=ROOT)


def figures_of(name: str, options: Sequence[str] = ()) -> list[Figure]:
    """Run a measurement once, and return its figures.

    Raises:
        subprocess.CalledProcessError: it failed.
    """
    said = subprocess.run(_command(name, [*options, "--json"]), check=True, cwd=ROOT, stdout=subprocess.PIPE).stdout
    return list(importlib.import_module(f"bench.{name}").measures(json.loads(said)))


def _command(name: str, options: Sequence[str]) -> list[str]:
    return [sys.executable, "-m", f"bench.{name}", *options]
