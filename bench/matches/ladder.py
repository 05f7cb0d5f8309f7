"""Play full games of a scripted player against the computer's levels, and tabulate how many it wins.

    python -m bench ladder                                             three races, ECEB and SCEB, levels 1 to 4
    python -m bench ladder --levels very_easy hard --games 10 --jobs 2
    python -m bench ladder --tasks simple64_sceb_zerg --against terran --json

A game has a seed of its own, the agents of its task in this process, and an observation and a reply for each of them at
each step, as over the bus. The intervals are Wilson's, of 95 %. A game that reaches the task's `max_steps` is not won.
"""

from __future__ import annotations

import asyncio
import json
import logging
import random
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from itertools import product
from typing import TYPE_CHECKING, get_args

from bench.command_line import make_parser
from khala_agents.scripted.players import PLAYERS, PlayerName
from khala_bridge.task.maps import Difficulty, Race
from khala_bridge.task.opponent import Opponent
from khala_orchestrator.config import MatchConfig, load_task
from khala_protocol.bus import Delivery
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.codec import decode_as, encode
from khala_protocol.keys import Topic, agent_key, alive_key
from khala_protocol.messages import Observation, Reply
from khala_sc2.experiment.statistics import wilson
from khala_sc2.playing import games
from khala_sc2.playing.hosting import host_match

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from typing import TypeAlias

    from khala_protocol.bus.memory import MemoryBus
    from khala_protocol.messages import Result

    Hear: TypeAlias = Callable[[str, Observation, str], None]
    """Gets the name of an agent, an observation, and the reply to it."""

RUN = "ladder"
TASKS = tuple(f"simple64_{mode}{race}" for mode in ("eceb", "sceb") for race in ("", "_terran", "_zerg"))
LEVELS = ("very_easy", "easy", "medium", "medium_hard")


@dataclass(frozen=True, slots=True)
class Pairing:
    """Who plays whom, and with which seed."""

    task: str
    against: Race | None
    """Race of the computer; None for the task's."""
    level: Difficulty
    seed: int
    player: PlayerName


@dataclass(frozen=True, slots=True)
class Game:
    """A game that was played."""

    pairing: Pairing
    outcome: str
    steps: int
    game_s: float
    wall_s: float
    accepted: int
    rejected: int


def play(pairing: Pairing) -> Game:
    """Play one game in this process."""
    result = watch(pairing)
    rejected = sum(result.rejections.values())
    return Game(pairing, result.outcome, result.steps, result.game_s, result.wall_s, result.accepted, rejected)


def watch(pairing: Pairing, hear: Hear = lambda *_: None, *, steps: int | None = None) -> Result:
    """Play one game in this process, of so many decisions at most; `hear` gets every observation with its reply."""
    logging.getLogger("absl").setLevel(logging.ERROR)  # PySC2 warns of abilities that it does not know
    return asyncio.run(_play(pairing, hear, steps))


async def _play(pairing: Pairing, hear: Hear, steps: int | None) -> Result:
    opponent = Opponent(race=pairing.against or load_task(pairing.task).opponent.race, difficulty=pairing.level)
    task = load_task(pairing.task)
    task = task.model_copy(update={"opponent": opponent, "max_steps": steps or task.max_steps})
    config = MatchConfig(task=task, run=RUN, seed=pairing.seed)
    sc2path, _ = games.find("simulator")
    broker = MemoryBroker()
    agents = [
        asyncio.create_task(_answer(broker.session(), task.side, agent.name, pairing.player, hear))
        for agent in task.agents
    ]
    try:
        (result,) = await host_match(config, sc2path, broker.session())
    finally:
        for agent in agents:
            agent.cancel()
    return result


async def _answer(bus: MemoryBus, side: str, name: str, player: PlayerName, hear: Hear) -> None:
    """Answer each observation of an agent, until cancelled."""
    observations = await bus.subscribe(agent_key(RUN, side, name, Topic.OBSERVATION), Delivery.STATE)
    replies = await bus.publisher(agent_key(RUN, side, name, Topic.REPLY), Delivery.SPEECH)
    await bus.announce(alive_key(RUN, side, name, "1"))
    async for sample in observations:
        seen = decode_as(Observation, sample.payload)
        text = PLAYERS[player](seen.text, random.Random(seen.text))
        hear(name, seen, text)
        reply = Reply(run=RUN, side=side, agent=name, episode=seen.episode, step=seen.step, text=text)
        await replies.put(encode(reply))


def table(played: Sequence[Game]) -> Iterator[str]:
    """Yield the lines of a Markdown table: for each task and opponent, the games won at each level."""
    levels = list(dict.fromkeys(game.pairing.level for game in played))
    yield f"| task | against | {' | '.join(levels)} |"
    yield f"|---|---|{'---|' * len(levels)}"
    for task, against in dict.fromkeys((game.pairing.task, game.pairing.against) for game in played):
        rows = [game for game in played if (game.pairing.task, game.pairing.against) == (task, against)]
        cells = (_cell([game for game in rows if game.pairing.level == level]) for level in levels)
        yield f"| `{task}` | {against or load_task(task).map_spec.opponent} | {' | '.join(cells)} |"


def _cell(played: Sequence[Game]) -> str:
    won = Counter(game.outcome for game in played)["win"]
    share = wilson(won, len(played))
    return f"{won} of {len(played)} ({100 * share.low:.0f} to {100 * share.high:.0f} %)"


def main() -> int:
    """Play the games that the options describe, and print the table."""
    parser = make_parser(__doc__)
    parser.add_argument("--tasks", nargs="+", default=TASKS, metavar="TASK")
    parser.add_argument("--levels", nargs="+", default=LEVELS, choices=get_args(Difficulty), metavar="LEVEL")
    parser.add_argument("--against", nargs="+", default=[None], choices=get_args(Race), metavar="RACE")
    parser.add_argument("--player", default="skilled", choices=get_args(PlayerName))
    parser.add_argument("--games", type=int, default=1, help="number of games of each pairing")
    parser.add_argument("--seed", type=int, default=1, help="seed of the first game of each pairing")
    parser.add_argument("--jobs", type=int, default=1, help="games at the same time, each in a process")
    given = parser.parse_args()
    seeds = range(given.seed, given.seed + given.games)
    pairings = [Pairing(*each, given.player) for each in product(given.tasks, given.against, given.levels, seeds)]
    with ProcessPoolExecutor(given.jobs, max_tasks_per_child=1) as pool:
        played: list[Game] = []
        for game in pool.map(play, pairings):
            print(f"{game.pairing}: {game.outcome} after {game.game_s:.0f} s", file=sys.stderr)
            played.append(game)
    print(json.dumps([asdict(game) for game in played]) if given.json else "\n".join(table(played)))
    return 0
