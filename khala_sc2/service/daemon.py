"""The service: orders in, matches out, each in a worker of its own; it plays nothing itself.

All that it knows of a match it hears on the bus, as anybody could: `khala watch` hears the same. A worker that is lost
takes its match no further than to the next worker, which goes on from the recording.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Protocol

from khala_protocol.bus import Delivery
from khala_protocol.codec import decode, encode
from khala_protocol.errors import KhalaError, PeerError
from khala_protocol.keys import EVERY_ORDER, MATCHES_KEY, Topic, every_agent, every_run, order_key
from khala_protocol.messages import Report, Result
from khala_protocol.service import Stop, Submit, decode_order
from khala_sc2.playing.jobs import Ended, Job
from khala_sc2.playing.matches import free_recording
from khala_sc2.service.book import Book, BookEntry, Limits
from khala_sc2.service.memory import rss_mb
from khala_sc2.service.orders import match_of

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Sequence
    from pathlib import Path

    from khala_orchestrator.config import MatchConfig
    from khala_protocol.bus import Bus, Publisher, Sample, Subscription
    from khala_protocol.bus.config import BusConfig
    from khala_protocol.messages import Wire
    from khala_protocol.service import MatchState, Order
    from khala_sc2.playing.minds import Minds
    from khala_sc2.service.pool import Player

log = logging.getLogger(__name__)

STARTS = 3
"""A match that loses more workers than this is at fault itself."""
LISTED_EVERY_S = 0.25
LOOKED_EVERY_S = 1.0
MEASURED_EVERY_S = 2.0


class MatchListener(Protocol):
    """What else hears the matches: metrics, traces."""

    def hear(self, message: Wire) -> None:
        """Take a message of a match."""

    def book(self, book: Book, used_mb: int) -> None:
        """Look at the list of matches, from time to time."""


@dataclass
class Service:
    """One service on an open bus."""

    bus: Bus
    joins: BusConfig
    """How workers join the bus."""
    take: Callable[[], Awaitable[Player]]
    """Takes a worker from the pool."""
    out: Path
    limits: Limits
    drain_s: float = 600.0
    listeners: Sequence[MatchListener] = ()
    exchanges: bool = False
    """Whether a listener wants what agents asked their models."""
    used_mb: Callable[[], int] = lambda: 0
    """Memory of the service with all of its processes."""
    measure: Callable[[int], int] = rss_mb
    """Memory of one process with all below it."""
    _players: dict[str, Player] = field(default_factory=dict)
    _playing: set[asyncio.Task[None]] = field(default_factory=set)
    _changed: asyncio.Event = field(default_factory=asyncio.Event)

    def __post_init__(self) -> None:
        self.book = Book(self.limits)

    async def run(self, stop: asyncio.Event) -> None:
        """Take and play matches until `stop` is set; then let those that run end, for `drain_s` at most."""
        async with contextlib.AsyncExitStack() as stack:
            orders = await self.bus.subscribe(EVERY_ORDER, Delivery.SPEECH)
            heard = [await self.bus.subscribe(every_run(Topic.REPORT), Delivery.LOG)]
            heard.append(await self.bus.subscribe(every_run(Topic.RESULT), Delivery.STATE))
            if self.exchanges:
                heard.append(await self.bus.subscribe(every_agent(None, Topic.EXCHANGE), Delivery.LOG))
            list_ = await self.bus.publisher(MATCHES_KEY, Delivery.STATE)
            for subscription in (orders, *heard):
                stack.push_async_callback(subscription.close)
            stack.push_async_callback(list_.close)
            ending = asyncio.create_task(stop.wait())
            tasks = [
                asyncio.create_task(work)
                for work in (
                    self._orders(orders),
                    *map(self._hear, heard),
                    self._begin(),
                    self._list(list_),
                    self._measure(),
                )
            ]
            try:
                await asyncio.wait({ending, *tasks}, return_when=asyncio.FIRST_COMPLETED)
                if ending.done():
                    await self._drain()
                    await list_.put(encode(self.book.matches()))
            finally:
                ended = {ending, *tasks, *self._playing}
                for task in ended:
                    task.cancel()
                await asyncio.wait(ended)
            for task in tasks:
                if not task.cancelled() and (error := task.exception()):
                    raise error

    # --- orders ---------------------------------------------------------------------------------------

    async def _orders(self, orders: Subscription[Sample]) -> None:
        async for sample in orders:
            try:
                order = decode_order(sample.payload)
                if sample.key == order_key(order.number):
                    await self._obey(order)
            except PeerError as error:
                log.warning("an invalid order: %s", error)
            self._changed.set()

    async def _obey(self, order: Order) -> None:
        match order:
            case Submit() if not self.book.knows(order.number):
                await self._submit(order)
            case Stop() if (entry := self.book.entry(order.run)) is not None:
                self._stop(entry, "stopped by an order")

    async def _submit(self, order: Submit) -> None:
        try:
            match = None if self.book.why_not(order.run, order.owner) else await self._match(order)
            if match is None or self.book.draining:  # it may have begun meanwhile
                self.book.refuse(order, self.book.why_not(order.run, order.owner))
                return
            entry = self.book.add(order, *match)
            log.info("match taken: %s for %s", entry.card.task, order.owner or "nobody", extra={"run": order.run})
        except KhalaError as error:
            self.book.refuse(order, str(error))
        except Exception as error:  # an order comes from somewhere else: it must not end the service
            log.exception("an order that cannot be read", extra={"run": order.run[:64]})
            self.book.refuse(order, f"the service could not read it: {type(error).__name__}")

    async def _match(self, order: Submit) -> tuple[MatchConfig, dict[str, Minds]]:
        read = partial(match_of, order, self.out, trusts=self.limits.trusts)
        return await asyncio.to_thread(read) if order.resume else read()  # a long recording takes seconds to read

    def _stop(self, entry: BookEntry, because: str) -> None:
        if entry.card.state == "queued":
            self._close(entry, "stopped", because)
        elif entry.card.state == "running" and not entry.stop_because:
            entry.stop_because = because
            if (player := self._players.get(entry.card.number)) is not None:
                player.stop()

    # --- matches --------------------------------------------------------------------------------------

    async def _begin(self) -> None:
        """Begin matches when there is room."""
        while True:
            while (entry := self.book.next(self.used_mb())) is not None:
                self.book.begin(entry)
                task = asyncio.create_task(self._play(entry), name=f"match {entry.card.run}")
                self._playing.add(task)
                task.add_done_callback(self._playing.discard)
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(LOOKED_EVERY_S):  # memory comes free without a word
                    await self._changed.wait()
            self._changed.clear()

    async def _play(self, entry: BookEntry) -> None:
        """Play a match in a worker, and in another one if that is lost."""
        ended = Ended(state="lost", words="its worker was lost")
        try:
            while ended.state == "lost" and entry.card.starts < STARTS and not entry.stop_because:
                entry.update(starts=entry.card.starts + 1)
                ended = await self._once(entry)
                if ended.state == "lost":
                    log.warning("%s", ended.words, extra={"run": entry.card.run})
        except Exception as error:  # whatever it is, it is this match's alone
            log.exception("the match could not be played", extra={"run": entry.card.run})
            ended = Ended(state="error", words=f"{type(error).__name__}: {error}")
        self._close(entry, *_outcome(entry, ended))

    async def _once(self, entry: BookEntry) -> Ended:
        assert entry.config is not None
        resume = entry.resume or (entry.card.starts > 1 and entry.card.step + len(entry.card.outcomes) > 0)
        directory = self.out / entry.card.run
        job = Job(
            config=entry.config.model_copy(update={"record": free_recording(directory)}),
            minds=dict(entry.minds),
            processes=True,
            bus=self.joins,
            beginning=directory if resume else None,
        )
        player = await self.take()
        self._players[entry.card.number] = player
        try:
            if entry.stop_because:
                return Ended(state="stopped")
            return await player.play(job)
        finally:
            del self._players[entry.card.number]
            await player.close()

    def _close(self, entry: BookEntry, state: MatchState, reason: str) -> None:
        self.book.close_match(entry, state, reason)
        log.info("match %s%s", state, f": {reason}" if reason else "", extra={"run": entry.card.run})
        self._changed.set()

    # --- what goes on -----------------------------------------------------------------------------------

    async def _hear(self, samples: Subscription[Sample]) -> None:
        async for sample in samples:
            try:
                message = decode(sample.payload)
            except PeerError as error:
                log.warning("%s: %s", sample.key, error)
                continue
            match message:
                case Report():
                    self.book.report(message)
                case Result():
                    self.book.result(message)
            for listener in self.listeners:
                try:
                    listener.hear(message)
                except Exception:  # what is counted of matches must not end them
                    log.exception("a message could not be counted", extra={"run": message.run})

    async def _list(self, list_: Publisher) -> None:
        """Publish the list, some times a second, if it is another one."""
        last = b""
        while True:
            if (now := encode(self.book.matches())) != last:
                await list_.put(now)
                last = now
            await asyncio.sleep(LISTED_EVERY_S)

    async def _measure(self) -> None:
        """Watch what matches take in memory, and end the largest one if all take too much."""
        while True:
            for entry in self.book.of("running"):
                if (player := self._players.get(entry.card.number)) is not None:
                    self.book.note_memory(entry, self.measure(player.pid))
            used_mb = self.used_mb()
            if (large := self.book.too_large(used_mb)) is not None:
                limit = self.limits.memory_mb
                self._stop(large, f"it had {large.card.rss_mb} MB when all had {used_mb} of {limit} MB (--memory-gb)")
            for listener in self.listeners:
                listener.book(self.book, used_mb)
            await asyncio.sleep(MEASURED_EVERY_S)

    # --- the end ----------------------------------------------------------------------------------------

    async def _drain(self) -> None:
        self.book.draining = True
        for entry in self.book.of("queued"):
            self._stop(entry, "the service ended before its turn came")
        log.info("ending: %d matches are being played, for %g s at most", len(self._playing), self.drain_s)
        if self._playing:
            await asyncio.wait(set(self._playing), timeout=self.drain_s)
        for entry in self.book.of("running"):
            self._stop(entry, "the service ended")
        if self._playing:
            await asyncio.wait(set(self._playing))


def _outcome(entry: BookEntry, ended: Ended) -> tuple[MatchState, str]:
    """Return what became of a match."""
    how = f"; `khala submit --resume {entry.card.run}` goes on" if entry.card.step else ""
    state = "stopped" if entry.stop_because and ended.state != "done" else ended.state
    match state:
        case "done":
            return "done", f"not valid: {ended.words}" if ended.words else ""
        case "error":
            return "failed", ended.words
        case "stopped":
            became: MatchState = "failed" if "--memory-gb" in entry.stop_because else "stopped"
            return became, (entry.stop_because or ended.words) + how
    return "failed", f"{ended.words}, {entry.card.starts} times{how}"
