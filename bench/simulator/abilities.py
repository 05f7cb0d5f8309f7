"""Measure how long a game takes to say what its units can do, as every observation asks it.

The simulator runs in its own process, and PySC2 asks it over its websocket, as in a match: the base and the
workers that a game of Simple64 begins with, plus 30 and 100 units of sixteen types. The time is that of
the question, its transport, its answer, and of reading it into a snapshot.
"""

from __future__ import annotations

import json
import statistics
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from s2clientprotocol import debug_pb2

from bench.command_line import make_parser
from bench.figures import Figure
from bench.tables import print_table
from khala_bridge.act.raw_executor import RawExecutor
from khala_bridge.game.game import GameConfig
from khala_bridge.game.pysc2_game import PySC2Game
from khala_bridge.knowledge import knowledge
from khala_bridge.task.maps import known_maps
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_bridge.state import Snapshot

ARMY = (
    "Stalker", "Zealot", "Sentry", "HighTemplar", "Immortal", "Phoenix", "VoidRay", "Oracle", "Marine", "Marauder",
    "Ghost", "Medivac", "Queen", "Ravager", "Infestor", "Roach",
)  # fmt: skip
SIZES = (0, 30, 100)
ROUNDS = 100


def measure(sizes: tuple[int, ...] = SIZES) -> list[dict[str, Any]]:
    """Return one row for each number of units added to those that a game begins with."""
    with tempfile.TemporaryDirectory() as directory:
        game = PySC2Game(GameConfig(sc2path=install(Path(directory) / "sc2"), map=known_maps()["Simple64"], seed=1))
        try:
            return [_row(game, size) for size in sizes]
        finally:
            game.close()


def _row(game: PySC2Game, size: int) -> dict[str, Any]:
    now = _with_army(game, size)
    times = []
    answer = now.abilities or {}
    for _ in range(ROUNDS):
        start = time.perf_counter()
        game._with_abilities([now])  # noqa: SLF001  # the very thing that is to be measured
        times.append((time.perf_counter() - start) * 1000)
    return {
        "units": len(answer),
        "abilities": sum(map(len, answer.values())),
        "median_ms": round(statistics.median(times), 2),
        "p95_ms": round(sorted(times)[int(ROUNDS * 0.95)], 2),
    }


def _with_army(game: PySC2Game, size: int) -> Snapshot:
    (now,) = game.reset()
    place = now.own[0].pos
    commands = []
    for index in range(size):
        unit = debug_pb2.DebugCreateUnit(unit_type=knowledge()[ARMY[index % len(ARMY)]].id, owner=1, quantity=1)
        unit.pos.x, unit.pos.y = place.x, place.y
        commands.append(debug_pb2.DebugCommand(create_unit=unit))
    game._env._controllers[0].debug(commands)  # noqa: SLF001  # the only way to units that the map does not have
    (turn,) = game.act([RawExecutor().plan([], now, 2)])
    return turn.snapshot


def measures(found: Any) -> Iterator[Figure]:
    """Yield what asking for the abilities of all own units costs."""
    for row in found:
        yield Figure(f"abilities of {row['units']} units", "ms", (row["median_ms"],))


def main() -> None:
    """Print the measurements."""
    parser = make_parser(__doc__)
    arguments = parser.parse_args()
    rows = measure()
    if arguments.json:
        print(json.dumps(rows))
        return
    print_table(("own units", "abilities", "median ms", "p95 ms"), [row.values() for row in rows])
