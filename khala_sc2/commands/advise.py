"""`khala advise`: read the reports of a running match, and write to its agents.

A line of stdin is a message, for one agent if it begins with `@NAME`; on stdout is a line for each step. The host
decides what becomes of a message: it takes those of the advisers that the task names, as many as it takes of agents.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import sys
import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, TextIO, TypeVar

from khala_orchestrator.console import clock, visible_message
from khala_orchestrator.words.mailbox import EVERYONE
from khala_protocol.bus import Delivery
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.codec import decode_as, encode
from khala_protocol.commandline import say
from khala_protocol.common_names import adviser_name
from khala_protocol.errors import ConfigError, KhalaError, NoRouter, PeerError
from khala_protocol.joining import client_config
from khala_protocol.keys import Topic, agent_key, host_key, run_key
from khala_protocol.messages import MAX_ADVICE_CHARACTERS, Advice, Report, Result, Run
from khala_protocol.visible import visible_line
from khala_sc2.playing import local_bus

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Iterator, Sequence
    from pathlib import Path

    from khala_protocol.bus import Bus, Liveness, Publisher, Sample, Subscription
    from khala_protocol.bus.config import BusConfig

M = TypeVar("M", Report, Result)

FIND_S = 5.0
"""How long to wait for the run card, which every running match has published, and for a host that is away."""


FIND_NEAR_S = 1.0
"""The same where another match of this machine may be the right one."""


class NoMatch(ConfigError):
    """There is no such match on a bus."""


class MatchGone(KhalaError):
    """The host went away, and there is no result."""


@dataclass(frozen=True, slots=True)
class Adviser:
    """Who advises in which run."""

    run: str
    side: str
    name: str
    recipient: str = EVERYONE
    """Of messages that name none."""

    def advice(self, line: str, card: Run) -> Advice:
        """Return the message that a line holds.

        Raises:
            ConfigError: it is too long, or for nobody of this side.
        """
        recipient = self.recipient
        text = line.strip()
        if text.startswith("@"):
            recipient, _, text = text[1:].partition(" ")
        if not text.strip():
            raise ConfigError("there is no text: write a line, or @NAME and a line")
        if len(text) > MAX_ADVICE_CHARACTERS:
            raise ConfigError(f"a message has at most {MAX_ADVICE_CHARACTERS} characters, and this one {len(text)}")
        agents = [agent.name for agent in card.agents if agent.side == self.side]
        if recipient.casefold() not in {EVERYONE, *map(str.casefold, agents)}:
            raise ConfigError(f"there is no agent {recipient!r}: write to {', '.join(agents)} or {EVERYONE}")
        return Advice(run=self.run, side=self.side, agent=self.name, recipient=recipient, text=text)


class Advising:
    """The part of an adviser in a running match.

    Args:
        bus: a session on the bus of the match.
        adviser: who writes.
        show: is called with the run card, every report of the side and every result.
        complain: is called with a sentence about each line that is no message.
    """

    def __init__(
        self,
        bus: Bus,
        adviser: Adviser,
        *,
        show: Callable[[Run | Report | Result], None],
        complain: Callable[[str], None],
    ) -> None:
        self._bus, self._adviser = bus, adviser
        self._show, self._complain = show, complain

    async def play(self, lines: AsyncIterator[str], *, find_s: float = FIND_S) -> None:
        """Advise until the match is over; the end of the lines ends nothing.

        Raises:
            ConfigError: there is no such run within `find_s`, or the adviser may not write to its agents.
            MatchGone: the host is away for `find_s`.
        """
        async with contextlib.AsyncExitStack() as stack:
            reports = await self._hear(stack, Topic.REPORT, Delivery.LOG)
            results = await self._hear(stack, Topic.RESULT, Delivery.STATE)
            hosts = await self._bus.watch(host_key(self._adviser.run))
            stack.push_async_callback(hosts.close)
            card = await card_of(self._bus, self._adviser, find_s)
            key = agent_key(self._adviser.run, self._adviser.side, self._adviser.name, Topic.ADVICE)
            publisher = await self._bus.publisher(key, Delivery.SPEECH)
            stack.push_async_callback(publisher.close)
            self._show(card)
            writing = asyncio.create_task(self._write(publisher, lines, card), name="write advice")
            reading = asyncio.create_task(self._read_reports(reports), name="read reports")
            try:
                await self._read_results_while(hosts, results, card, away_s=find_s)
            finally:
                await reports.close()  # what has arrived is still shown
                writing.cancel()
                await asyncio.wait({writing, reading})

    async def _hear(self, stack: contextlib.AsyncExitStack, topic: Topic, delivery: Delivery) -> Subscription[Sample]:
        subscription = await self._bus.subscribe(run_key(self._adviser.run, topic), delivery)
        stack.push_async_callback(subscription.close)
        return subscription

    async def _write(self, publisher: Publisher, lines: AsyncIterator[str], card: Run) -> None:
        async for line in lines:
            try:
                await publisher.put(encode(self._adviser.advice(line, card)))
            except ConfigError as error:
                self._complain(str(error))

    def _read(self, kind: type[M], sample: Sample) -> M | None:
        """Return the message of a sample; complain of one that is malformed, and go on with the next."""
        try:
            return decode_as(kind, sample.payload)
        except PeerError as error:
            self._complain(f"left out what came under {sample.key}: {error}")
            return None

    async def _read_reports(self, reports: Subscription[Sample]) -> None:
        async for sample in reports:
            report = self._read(Report, sample)
            if report is not None and report.side == self._adviser.side:
                self._show(report)

    async def _read_results_while(
        self, hosts: Subscription[Liveness], results: Subscription[Sample], card: Run, *, away_s: float
    ) -> None:
        """Read results as long as the host is there; a link that comes back, or a host that goes on, loses nothing."""
        loop = asyncio.get_running_loop()

        async def watch() -> None:
            async for host in hosts:
                patience.reschedule(None if host.alive else loop.time() + away_s)

        try:
            async with asyncio.timeout(None) as patience:
                watching = asyncio.create_task(watch(), name="watch the host")
                try:
                    await self._read_results(results, card)
                finally:
                    watching.cancel()
        except TimeoutError:
            raise MatchGone(
                f"the match {card.run!r} is gone: its host went away without a result, and was not back within "
                f"{away_s:g} s; `khala run --resume` or `khala host --resume` continues it from its recording"
            ) from None

    async def _read_results(self, results: Subscription[Sample], card: Run) -> None:
        """Show results until that of the last episode, or of one that was aborted, has come for every side."""
        sides = {agent.side for agent in card.agents}
        async for sample in results:
            result = self._read(Result, sample)
            if result is None:
                continue
            self._show(result)
            if result.outcome == "aborted" or result.episode >= card.episodes - 1:
                sides.discard(result.side)
            if not sides:
                return


async def card_of(bus: Bus, adviser: Adviser, find_s: float) -> Run:
    """Return the card of the run, which has this adviser.

    Raises:
        NoMatch: there is no such run within `find_s`.
        ConfigError: the adviser may not write to its agents.
    """
    cards = await bus.subscribe(run_key(adviser.run, Topic.RUN), Delivery.STATE)
    try:
        async with asyncio.timeout(find_s):
            card = decode_as(Run, (await anext(cards)).payload)
    except TimeoutError:
        raise NoMatch(f"no match of the name {adviser.run!r} was found: is it running, and at this endpoint?") from None
    finally:
        await cards.close()
    if adviser.name not in card.advisers:
        known = ", ".join(card.advisers) or "none"
        raise ConfigError(f"the task has no adviser {adviser.name!r}; it has {known}: see `advisers` in task files")
    return card


async def lines_of(stream: TextIO) -> AsyncIterator[str]:
    """Yield the lines of a stream as they come; a thread waits for them, and does not keep the process from ending."""
    loop = asyncio.get_running_loop()
    lines = asyncio.Queue[str | None]()

    def read() -> None:
        with contextlib.suppress(RuntimeError):  # the loop is closed: nobody waits for lines any more
            for line in stream:
                loop.call_soon_threadsafe(lines.put_nowait, line)
            loop.call_soon_threadsafe(lines.put_nowait, None)

    threading.Thread(target=read, name="lines", daemon=True).start()
    while (line := await lines.get()) is not None:
        if line.strip():
            yield line


def lines_about(message: Run | Report | Result) -> Iterator[str]:
    """Yield the lines that tell a person of a message."""
    message = visible_message(message)
    match message:
        case Run():
            names = ", ".join(agent.name for agent in message.agents)
            yield f"{message.run}: {message.task}, agents {names}; a line is for all of them, @NAME and a line for one"
        case Report():
            agents = ", ".join(f"{agent.agent} {agent.status}" for agent in message.agents) or "nobody decided"
            yield f"{clock(message.game_loop)}  step {message.step}  score {message.score:g}  {agents}"
            yield from (f"    {m.sender} → {m.recipient}: {visible_line(m.text)}" for m in message.messages)
        case Result():
            yield f"{message.side}: {message.ending} (episode {message.episode})"


def run_advise(adviser: Adviser, *, connect: Sequence[str], tls: Path | None, insecure: bool, as_json: bool) -> None:
    """Advise from stdin, on stdout, until the match is over."""

    def show(message: Run | Report | Result) -> None:
        for line in [json.dumps(message.model_dump(mode="json"))] if as_json else lines_about(message):
            say(line)

    async def advise_at(config: BusConfig, find_s: float) -> None:
        try:
            bus = await open_bus(config)
        except NoRouter as error:
            what = "this machine plays no match of yours" if not connect else "the match is elsewhere, or over"
            raise NoMatch(f"{what}: {error.found}; --connect says where it is") from None
        try:
            advising = Advising(bus, adviser, show=show, complain=lambda text: say(text, err=True))
            await advising.play(lines_of(sys.stdin), find_s=find_s)
        finally:
            await bus.close()

    async def play() -> None:
        *others, last = places(adviser, connect, tls, insecure=insecure)
        for config in others:
            with contextlib.suppress(NoMatch):
                return await advise_at(config, FIND_NEAR_S)
        return await advise_at(last, FIND_S)

    asyncio.run(play())


def places(adviser: Adviser, connect: Sequence[str], tls: Path | None, *, insecure: bool) -> list[BusConfig]:
    """Return where the match may be: at the endpoints given, or at one of those of this machine, the newest first."""
    if tls is None:
        near = [] if connect else [[endpoint] for endpoint in local_bus.running()]
        return [client_config(place, tls=None, insecure=insecure) for place in near or [list(connect)]]
    return [client_config(connect, tls=tls, names=(adviser_name(adviser.side, adviser.name),), insecure=insecure)]
