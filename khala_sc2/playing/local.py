"""Everything of a match on this machine: the one module that knows all packages.

The host runs in this process, with the game's PySC2 in one of its threads, and it is its own router; so does the
endpoint of the scripted model. Agents run in their own processes and join over Zenoh, as they would from another
machine.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections import Counter
from dataclasses import dataclass
from math import ceil
from typing import TYPE_CHECKING

from khala_orchestrator.roster import Seat
from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.errors import RecordingError
from khala_protocol.files import make_private
from khala_protocol.messages import Report
from khala_sc2.playing import games
from khala_sc2.playing.children import Children, Spawn, spawn
from khala_sc2.playing.hosting import host_match
from khala_sc2.playing.local_bus import local_endpoint
from khala_sc2.playing.minds import declare_rethink, groups_of, scripted_endpoint
from khala_sc2.playing.spending import ledger_of

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Iterator, Mapping, Sequence
    from pathlib import Path
    from typing import Any

    from khala_agents.llm.money import MoneyLedger
    from khala_bridge.game.processes import Processes
    from khala_orchestrator.config import MatchConfig
    from khala_orchestrator.past.resume import Unfinished
    from khala_protocol.messages import Result, Wire
    from khala_sc2.playing.minds import Minds

log = logging.getLogger(__name__)

MAX_PROCESSES = 4
"""Up to this many agents with a policy have a process each, more share them: code of the user may compute, block or
crash, and a Python process costs a second of processor time and 60 MB. Agents of two sides never share one, and each
side gets half of the processes."""
AGENTS_A_PROCESS = 16
"""So many agents with a model share a process, since all they do is wait: 2 ms of processor time a decision. If it is
killed, they are away together until it is started again, 2 s later, and the match goes on."""


@dataclass(frozen=True, slots=True)
class Supplies:
    """What a match finds ready; what is missing, it makes."""

    bus: BusConfig | None = None
    """How to join a router that is there."""
    spawn: Spawn = spawn
    """Where the processes of agents come from."""
    processes: Processes | None = None
    """Where the process of the game comes from, and goes afterwards."""


async def play(
    config: MatchConfig,
    minds: Mapping[str, Minds],
    directory: Path,
    *,
    game: str,
    watch: Callable[[Wire], None] = lambda _: None,
    past: Unfinished | None = None,
    supplies: Supplies | None = None,
) -> list[Result]:
    """Play a match with everything it needs on this machine.

    Args:
        config: the match to play.
        minds: by side, how its agents decide.
        directory: is created, and gets the logs of the processes.
        game: `simulator`, `starcraft2`, or a directory.
        watch: is called with the run card, every report and every result.
        past: what was played of this match before its host was lost.
        supplies: what is ready for it.

    Raises:
        KhalaError: the user can fix something; the text says what.
    """
    for _, mind, _ in groups_of(config.task, minds):
        mind.check(config.task.clock)
    supplies = supplies or Supplies()
    config, sc2path = _prepare(config, directory, game)
    groups = [(side, mind, names) for side, mind, names in groups_of(config.task, minds) if not mind.policy]
    config = declare_rethink(config, {Seat(side, name): mind.rethink for side, mind, names in groups for name in names})
    async with contextlib.AsyncExitStack() as stack:
        joined = supplies.bus or BusConfig(mode="router", listen=(stack.enter_context(local_endpoint()),))
        bus = await open_bus(joined)
        stack.push_async_callback(bus.close)
        base_url = await scripted_endpoint(stack, groups_of(config.task, minds))
        ledger = stack.enter_context(ledger_of(config.record or directory / "recording", past))
        if past is not None and (before := spent_before(ledger, minds)):
            log.warning("%s", before)
        common = ["--run", config.run, "--connect", bus.endpoints[0], "--ledger", str(ledger.path)]
        children = await stack.enter_async_context(Children(directory, supplies.spawn))
        for share in _shares_of(list(groups_of(config.task, minds)), common, base_url):
            await children.start(share.process, *share.arguments, environ=share.environ)
        begun = asyncio.Event()

        def see(message: Wire) -> None:
            if isinstance(message, Report):
                begun.set()
            watch(message)

        match = host_match(config, sc2path, bus, watch=see, past=past, processes=supplies.processes)
        return await _unless_one_dies(match, children, begun)


async def play_hosted(
    config: MatchConfig,
    bus: BusConfig,
    directory: Path,
    *,
    game: str,
    watch: Callable[[Wire], None] = lambda _: None,
    past: Unfinished | None = None,
) -> list[Result]:
    """Play a match whose agents come over the bus; arguments and errors as in `play`."""
    config, sc2path = _prepare(config, directory, game)
    async with contextlib.AsyncExitStack() as stack:
        session = await open_bus(bus)
        stack.push_async_callback(session.close)
        return await host_match(config, sc2path, session, watch=watch, past=past)


def shares(agents: Sequence[str], processes: int = MAX_PROCESSES) -> list[list[str]]:
    """Return which agents share a process: as evenly as their number allows, neighbours apart."""
    return [list(agents[first::processes]) for first in range(min(processes, len(agents)))]


@dataclass(frozen=True, slots=True)
class _Share:
    """The agents of one process."""

    process: str
    side: str
    names: list[str]
    options: list[str]
    environ: dict[str, str]
    budget_usd: float | None
    """What all agents of the side may spend."""

    @property
    def arguments(self) -> list[str]:
        """The command line of the process."""
        budget = [] if self.budget_usd is None else ["--budget-usd", str(self.budget_usd)]
        return ["agent", *self.names, "--side", self.side, *self.options, *budget]


def spent_before(ledger: MoneyLedger, minds: Mapping[str, Minds]) -> str:
    """Return a sentence on what a match that is resumed has spent, and may still spend; "" if it has spent nothing."""
    if not (before_usd := ledger.booked_usd()):
        return ""
    said = f"{before_usd:.4f} USD were spent before"
    limits = {side: mind.budget_usd for side, mind in minds.items() if mind.budget_usd is not None}
    if not limits:
        return f"{said}, and nothing limits what is spent from here: --budget-usd does"
    left = {side: max(limit - ledger.booked_usd(side), 0.0) for side, limit in limits.items()}
    said += f", {sum(left.values()):.4f} of the budget are left"
    poor = [side for side, usd in left.items() if not usd]
    return f"{said}; nothing for side {', '.join(poor)}, so that its models are not asked" if poor else said


def _shares_of(
    groups: Sequence[tuple[str, Minds, list[str]]], joined: list[str], base_url: str | None
) -> Iterator[_Share]:
    """Yield the processes: agents that decide alike share some, and all of a side spend from one budget."""
    sides = Counter(side for side, _, _ in groups)
    for side, count in sides.items():
        each = max(1, MAX_PROCESSES // len(sides) // count)
        parts = [
            (mind, part)
            for of, mind, names in groups
            if of == side
            for part in shares(names, each if mind.policy else min(each, ceil(len(names) / AGENTS_A_PROCESS)))
        ]
        for number, (mind, names) in enumerate(parts):
            process = f"agents-{number}" if len(sides) == 1 else f"agents-{side}-{number}"
            yield _Share(process, side, names, [*joined, *mind.options(base_url)], mind.environ, mind.budget_usd)


async def _unless_one_dies(
    match: Coroutine[Any, Any, list[Result]], children: Children, begun: asyncio.Event
) -> list[Result]:
    """Return the results of the match. A child that fails before the first step, or for good, ends it."""
    playing, keeping = asyncio.create_task(match), asyncio.create_task(children.keep(begun))
    try:
        await asyncio.wait({playing, keeping}, return_when=asyncio.FIRST_COMPLETED)
        if not playing.done():
            await keeping
        return await playing
    finally:
        for task in (playing, keeping):
            task.cancel()
        await asyncio.wait({playing, keeping})


def _prepare(config: MatchConfig, directory: Path, game: str) -> tuple[MatchConfig, Path]:
    """Return the match with the name of its game, and the path of the game; create the directory."""
    try:
        make_private(directory)
    except OSError as error:
        raise RecordingError(f"{directory} cannot be made: {error.strerror}; --out names another place") from None
    sc2path, name = games.find(game)
    return config.model_copy(update={"game": name}), sc2path
