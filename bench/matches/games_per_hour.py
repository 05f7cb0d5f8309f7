"""Measure how many games an hour this machine plays with scripted players, several at once.

    python -m bench games_per_hour                                   six tasks, as many games at once as there are cores
    python -m bench games_per_hour --tasks 2s3z_pair --games 40      one of them, so many games
    python -m bench games_per_hour --jobs 4                          four games at once

Games are played as `khala experiment run --jobs` plays them: recorded, each with a seed of its own, agents that ask the
scripted model through its endpoint, which answers at once. Each process first plays a game that is not counted, since
the first one imports everything. A game that crashes is played once more, and its time counts. `cpu s` is the processor
time of a game, in all processes: on a busy machine it can be compared, and the games an hour cannot. Full games end
after seven minutes of the game.
"""

from __future__ import annotations

import asyncio
import json
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import psutil

from bench.command_line import make_parser
from bench.figures import Figure
from bench.tables import print_table
from khala_orchestrator.config import load_task
from khala_sc2.experiment.engine import Local, slots_of_this_machine
from khala_sc2.experiment.plan import plan
from khala_sc2.experiment.runner import Runner
from khala_sc2.experiment.spec import Experiment, ExperimentBudget
from khala_sc2.experiment.store import Store

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from khala_bridge.task.config import TaskConfig
    from khala_sc2.experiment.engine import Engine
    from khala_sc2.experiment.plan import PlannedMatch
    from khala_sc2.experiment.runner import RunnerEvent

LOOPS_PER_MINUTE: Final = 22.4 * 60
FULL_GAME_MINUTES: Final = 7


@dataclass(frozen=True, slots=True)
class Plays:
    """How a task is played here."""

    games: int
    """For each game at once."""
    goal: int | None = None
    """Games an hour on two cores."""
    minutes: int | None = None
    """Of the game, after which it ends."""

    def max_steps(self, task: TaskConfig) -> int | None:
        """Return after how many decisions a game ends, or None for the task's own limit."""
        return None if self.minutes is None else round(self.minutes * LOOPS_PER_MINUTE / task.clock.step_loops)


TASKS: Final = {
    "2s3z_pair": Plays(10, goal=2400),
    "3s5z": Plays(6),
    "2c_vs_64zg": Plays(4),
    "pvz_task1_level1": Plays(6),
    "pvz_task6_level1": Plays(3, goal=400),
    "simple64_eceb": Plays(1, goal=60, minutes=FULL_GAME_MINUTES),
}


@dataclass(frozen=True, slots=True)
class Played:
    """The games of one task."""

    task: str
    at_once: int
    games: int
    wall_s: float
    cpu_s: float
    goal: int | None

    @property
    def per_hour(self) -> float:
        """Games an hour, of all processes together."""
        return 3600 * self.games / self.wall_s

    @property
    def cpu_s_a_game(self) -> float:
        """Processor time of a game, of all its processes."""
        return self.cpu_s / self.games


def plan_games(name: str, games: int) -> list[PlannedMatch]:
    """Return so many games of a task, each with a seed of its own."""
    max_steps = TASKS.get(name, Plays(1)).max_steps(load_task(name))
    experiment: dict[str, Any] = {
        "name": "games",
        "fixed": {"model": "scripted/skilled", "latency_s": 0, **({"max_steps": max_steps} if max_steps else {})},
        "factors": {"task": [name]},
        "seeds": games,
    }
    return plan(Experiment.model_validate(experiment))


async def measure(name: str, games: int, at_once: int, out: Path) -> Played:
    """Play `games` games of a task, so many at once, after one more in each process.

    Raises:
        SystemExit: a game was not played to its end.
    """
    matches = plan_games(name, games + at_once)
    async with Local(at_once, game="simulator", logs=out / "logs") as engine:
        await _play(matches[:at_once], engine, out / "first")
        began_s = time.perf_counter()
        spent_s = _processor_s()
        await _play(matches[at_once:], engine, out / "counted")
        wall_s, cpu_s = time.perf_counter() - began_s, _processor_s() - spent_s
    goal = TASKS[name].goal if name in TASKS else None
    return Played(name, at_once, games, wall_s, cpu_s, goal)


async def _play(matches: Sequence[PlannedMatch], engine: Engine, out: Path) -> None:
    store = Store(out)
    store.directory.mkdir(parents=True)
    experiment = Experiment.model_validate({"name": "games", "factors": {"task": ["2s3z_pair"]}, "retries": 1})
    await Runner(experiment, store, engine, ExperimentBudget(), see=_check).play(matches)


def _check(event: RunnerEvent) -> None:
    """Say which game is played again, and stop at one that is not played to its end."""
    if event.what == "begins":
        return
    words = f"{event.match.title}, was not played to its end: {event.words}"
    if event.what == "again":
        print(f"{words}; it is played once more", file=sys.stderr)
    elif event.played is None or event.played.state != "done":
        raise SystemExit(words)


def _processor_s() -> float:
    """Return the processor time of this process and of all that it has started, those that ended included."""
    here = psutil.Process()
    times = [process.cpu_times() for process in (here, *here.children(recursive=True))]
    return float(
        sum(process.user + process.system + process.children_user + process.children_system for process in times)
    )


def measures(found: Any) -> Iterator[Figure]:
    """Yield games an hour and processor time of each task."""
    for row in found["rows"]:
        at_once = f"{row['task']}, {row['at_once']} at once"
        yield Figure(f"games an hour, {at_once}", "games", (row["per_hour"],), "more")
        yield Figure(f"processor time of a game, {at_once}", "s", (row["cpu_s_a_game"],))


def rows(played: Sequence[Played]) -> Iterator[tuple[object, ...]]:
    """Yield a row for the games of each task."""
    for batch in played:
        each_s = batch.wall_s * batch.at_once / batch.games
        goal = "" if batch.goal is None else batch.goal
        figures = f"{batch.per_hour:.0f}", goal, f"{each_s:.2f}", f"{batch.cpu_s_a_game:.2f}"
        yield batch.task, batch.at_once, batch.games, *figures


def main() -> None:
    """Play, and print a table or a JSON object."""
    parser = make_parser(__doc__)
    parser.add_argument("--tasks", nargs="+", default=list(TASKS), metavar="TASK")
    parser.add_argument("--games", type=int, help="games of each task; by default 1 to 10 for each at once")
    parser.add_argument("--jobs", type=int, default=slots_of_this_machine(), help="at once (default: %(default)s)")
    given = parser.parse_args()
    played = []
    with tempfile.TemporaryDirectory() as out:
        for name in given.tasks:
            games = given.games or TASKS.get(name, Plays(1)).games * given.jobs
            played.append(asyncio.run(measure(name, games, given.jobs, Path(out) / name)))
            print(f"{name}: {played[-1].per_hour:.0f} games an hour", file=sys.stderr)
    columns = ("task", "at once", "games", "games an hour", "goal", "s", "cpu s")
    print_table(columns, rows(played), file=sys.stderr if given.json else sys.stdout)
    if given.json:
        found = [asdict(batch) | {"per_hour": batch.per_hour, "cpu_s_a_game": batch.cpu_s_a_game} for batch in played]
        print(json.dumps({"rows": found}))
