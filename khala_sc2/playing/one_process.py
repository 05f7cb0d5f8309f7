"""A match whose agents decide in this process: no bus to another one, and no process but the game's.

It is played, judged and recorded by the same host as any other, and agents answer with the same workers, over the
bus in memory. Experiments play so, several matches at a time, each in a process. A policy that blocks blocks the
host, too; `khala_sc2.playing.local` gives agents processes of their own.
"""

from __future__ import annotations

import asyncio
import contextlib
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from khala_agents.llm.limits import own_turns
from khala_agents.llm.money import MoneyLedger, SharedBudget
from khala_agents.worker import run_workers
from khala_orchestrator.roster import Seat
from khala_protocol.bus.memory import MemoryBroker
from khala_sc2.playing import games
from khala_sc2.playing.hosting import host_match
from khala_sc2.playing.minds import declare_rethink, groups_of, scripted_endpoint
from khala_sc2.playing.spending import ledger_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from khala_agents.llm.limits import Gates
    from khala_agents.policy import Policy
    from khala_bridge.game.processes import Processes
    from khala_orchestrator.config import MatchConfig
    from khala_orchestrator.match.match import Asks
    from khala_orchestrator.past.resume import Unfinished
    from khala_protocol.messages import Result, Wire
    from khala_sc2.playing.minds import Minds


async def play(
    config: MatchConfig,
    minds: Mapping[str, Minds],
    *,
    game: str,
    watch: Callable[[Wire], None] = lambda _: None,
    past: Unfinished | None = None,
    processes: Processes | None = None,
    gates: Gates = own_turns,
    callers: Mapping[Seat, Policy] = MappingProxyType({}),
    asks: Asks = lambda *_: None,
    broker: MemoryBroker | None = None,
) -> list[Result]:
    """Play a match with its agents in this process.

    Args:
        config: the match to play.
        minds: by side, how its agents decide; without a side whose agents all have policies of the caller.
        game: `simulator`, `starcraft2`, or a directory.
        watch: is called with the run card, every report and every result.
        past: what was played of this match before.
        processes: where the process of the game comes from, and goes afterwards.
        gates: where requests to models wait for their turn.
        callers: by seat, policies of the caller, in place of its minds.
        asks: is called in each step with the agents that are asked.
        broker: of the bus, for a caller that listens to it, too.

    Raises:
        KhalaError: the user can fix something; the text says what.
    """
    sc2path, name = games.find(game)
    config = config.model_copy(update={"game": name})
    broker, stop = broker or MemoryBroker(), asyncio.Event()
    async with contextlib.AsyncExitStack() as stack:
        ledger = stack.enter_context(ledger_of(config.record, past) if config.record else MoneyLedger())
        by_side = await _policies(config, minds, ledger, stack, gates, callers)
        often = {Seat(side, name): mind.rethink for side, its in by_side.items() for name, mind in its.items()}
        config = declare_rethink(config, often)
        if past is not None:
            _remind(by_side, past)
        agents = [
            asyncio.create_task(run_workers(broker.session(), config.run, side, policies, stop=stop))
            for side, policies in by_side.items()
        ]
        try:
            session = broker.session()
            match = host_match(config, sc2path, session, watch=watch, past=past, processes=processes, asks=asks)
            return await _unless_one_fails(asyncio.create_task(match), agents)
        finally:
            stop.set()
            await asyncio.gather(*agents, return_exceptions=True)


async def _policies(
    config: MatchConfig,
    minds: Mapping[str, Minds],
    ledger: MoneyLedger,
    stack: contextlib.AsyncExitStack,
    gates: Gates,
    callers: Mapping[Seat, Policy],
) -> dict[str, dict[str, Policy]]:
    """Return the policies of all agents, by side; start the scripted endpoint if one asks it."""
    groups = list(groups_of(config.task, minds, taken=callers))
    base_url = await scripted_endpoint(stack, groups)
    budgets = {
        side: SharedBudget(mind.budget_usd, ledger=ledger, account=side, source=f"the budget of side {side}")
        for side, mind in minds.items()
    }
    made: dict[str, dict[str, Policy]] = {side.side: {} for side in config.task.per_side()}
    for seat, policy in callers.items():
        made[seat.side][seat.agent] = policy
    for side, mind, names in groups:
        made[side] |= mind.policies(names, base_url, budgets[side], gates)
    return made


def _remind(by_side: Mapping[str, Mapping[str, Policy]], past: Unfinished) -> None:
    """Have agents remember what was played before them."""
    for side, policies in by_side.items():
        for name, policy in policies.items():
            policy.remember(past.decisions(Seat(side, name)))


async def _unless_one_fails(match: asyncio.Task[list[Result]], agents: Sequence[asyncio.Task[Any]]) -> list[Result]:
    """Return the results; raise what an agent raised, which nobody else would see."""
    watched: set[asyncio.Task[Any]] = {match, *agents}
    try:
        while not match.done():
            done, watched = await asyncio.wait(watched, return_when=asyncio.FIRST_COMPLETED)
            for task in done - {match}:
                task.result()
        return match.result()
    finally:
        match.cancel()
        await asyncio.gather(match, return_exceptions=True)
