"""Measure how many times as long a client's step takes on the simulator as at a server that answers at once.

    python -m bench floors                                       a table
    python -m bench floors layers:2s3z:8 --rounds 5 --steps 300  interface:map:loops, as simulator_env takes it

In each round a battle is played on the simulator, and again with a server that repeats its answers. What that takes is
the client's own; a ratio of 1 would be a simulator that costs nothing, at 1.5 a third of a step is the simulator's. The
ratio is of processor time of client and server together, which other programs disturb little; `steps/s` is wall time.
"""

from __future__ import annotations

import json
import os
import statistics
import tempfile
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from absl import flags

from bench.command_line import make_parser
from bench.figures import Figure
from bench.simulator.at_once import floor
from bench.simulator.simulator_env import Measured, measure_env, setting_of
from bench.tables import print_table
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

LIMITS: Final[Mapping[str, float]] = {"layers:2s3z:8": 2.5, "layers:2c_vs_64zg:8": 2.5}
"""What is played: the most processor time that a step may take, in times of that with a server that answers at once."""
ROUNDS: Final = 3
STEPS: Final = 150


def measure(settings: Sequence[str], rounds: int, steps: int) -> dict[str, Any]:
    """Return what a step takes of each setting, with the simulator and with answers at once, one of each round."""
    found: dict[str, dict[str, list[float]]] = {
        setting: {name: [] for name in ("cpu_ms", "floor_cpu_ms", "steps_per_s")} for setting in settings
    }
    flags.FLAGS(["bench"])
    with tempfile.TemporaryDirectory() as directory:
        os.environ["SC2PATH"] = str(install(Path(directory)))
        for setting in [*settings] * rounds:
            play = partial(measure_env, setting_of(setting), steps)
            ours = play()
            least = floor(play)
            found[setting]["cpu_ms"].append(_cpu_ms(ours))
            found[setting]["floor_cpu_ms"].append(_cpu_ms(least))
            found[setting]["steps_per_s"].append(1e3 / statistics.fmean(ours.durations_ms))
    return found


def _cpu_ms(game: Measured) -> float:
    return game.client_ms + game.server_ms


def measures(found: Any) -> Iterator[Figure]:
    """Yield steps a second, processor time of a step, and the ratio, of every round."""
    for setting, row in found.items():
        yield Figure(f"steps a second, {setting}", "steps", tuple(row["steps_per_s"]), "more")
        yield Figure(f"processor time of a step, {setting}", "ms", tuple(row["cpu_ms"]))
        ratios = (ours / least for ours, least in zip(row["cpu_ms"], row["floor_cpu_ms"], strict=True))
        yield Figure(f"ours / answers at once, {setting}", "times", tuple(ratios), limit=LIMITS.get(setting))


def main() -> None:
    """Print the ratios."""
    parser = make_parser(__doc__)
    parser.add_argument("settings", nargs="*", default=list(LIMITS), help="interface:map:loops per step")
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--steps", type=int, default=STEPS, help="of a battle")
    given = parser.parse_args()
    found = measure(given.settings, given.rounds, given.steps)
    if given.json:
        print(json.dumps(found))
        return
    rows = []
    for setting, row in found.items():
        rate, ours, least = (statistics.median(row[name]) for name in ("steps_per_s", "cpu_ms", "floor_cpu_ms"))
        rows.append((setting, f"{rate:.0f}", f"{ours:.2f}", f"{least:.2f}", f"{ours / least:.2f}"))
    print_table(("", "steps/s", "cpu ms", "at once", "ratio"), rows)
