"""What a client says to a service, and hears from it: orders, the list of matches, the messages of one match."""

from __future__ import annotations

import asyncio
import contextlib
import getpass
import secrets
import socket
from typing import TYPE_CHECKING

from khala_protocol.bus import Delivery
from khala_protocol.codec import decode, decode_as, encode
from khala_protocol.errors import ConfigError, KhalaError, PeerError
from khala_protocol.keys import MATCHES_KEY, Topic, order_key, run_key
from khala_protocol.service import OPEN, MatchCard, Matches

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from khala_protocol.bus import Bus, Sample, Subscription
    from khala_protocol.messages import Wire
    from khala_protocol.service import Order

AGAIN_S = 2.0
"""An order that shows no effect is sent again."""
PATIENCE_S = 15.0
WATCHED = {Topic.RUN: Delivery.STATE, Topic.REPORT: Delivery.LOG, Topic.RESULT: Delivery.STATE}


class NoService(KhalaError):
    """Nobody answers on the bus."""


class Refused(KhalaError):
    """The service does not take the match."""


def new_number() -> str:
    """Return a number for an order that no other one has."""
    return secrets.token_hex(8)


def owner() -> str:
    """Return who we are, for the order of the queue."""
    try:
        return f"{getpass.getuser()}@{socket.gethostname()}"[:64]
    except (OSError, KeyError):  # a user id without a name
        return socket.gethostname()[:64]


async def list_matches(bus: Bus, *, within_s: float = PATIENCE_S) -> Matches:
    """Return the list of the service's matches.

    Raises:
        NoService: there is none on this bus.
    """
    lists = await bus.subscribe(MATCHES_KEY, Delivery.STATE, depth=1)
    try:
        return await _newest(lists, within_s)
    finally:
        await lists.close()


async def submit(bus: Bus, order: Order, *, within_s: float = PATIENCE_S) -> MatchCard:
    """Send an order for a match until the service lists it; return its card.

    Raises:
        Refused: the service does not take it; the text says why.
        NoService: there is none.
    """
    card = await _send_order(bus, order, lambda cards: _with_number(cards, order.number), within_s)
    if card.state == "refused":
        raise Refused(card.reason)
    return card


async def stop(bus: Bus, order: Order, *, within_s: float = PATIENCE_S) -> MatchCard:
    """Send an order to stop a match until it is over; return its card.

    Raises:
        ConfigError: there is no such match.
        NoService: there is no service.
    """
    find(await list_matches(bus, within_s=within_s), order.run)
    return await _send_order(bus, order, lambda cards: _over(cards, order.run), within_s)


async def watch(bus: Bus, run: str, show: Callable[[Wire], None], *, within_s: float = PATIENCE_S) -> MatchCard:
    """Show the messages of a match until it is over; return its card.

    Raises:
        ConfigError: there is no such match.
        NoService: there is no service.
    """
    heard = [await bus.subscribe(run_key(run, topic), delivery) for topic, delivery in WATCHED.items()]
    lists = await bus.subscribe(MATCHES_KEY, Delivery.STATE, depth=1)
    showing = [asyncio.create_task(_show(samples, show)) for samples in heard]
    try:
        matches = await _newest(lists, within_s)
        while (card := find(matches, run)).state in OPEN:
            matches = await _newest(lists, None)
        return card
    finally:
        for subscription in (*heard, lists):
            await subscription.close()
        await asyncio.gather(*showing)


def find(matches: Matches, run: str) -> MatchCard:
    """Return the newest match of this name.

    Raises:
        ConfigError: there is none.
    """
    found = [card for card in matches.matches if card.run == run and card.state != "refused"]
    if not found:
        names = ", ".join(card.run for card in matches.matches[-5:]) or "none at all"
        raise ConfigError(f"the service has no match {run!r}; its newest are {names}: `khala matches` lists all")
    return found[-1]


async def _send_order(
    bus: Bus, order: Order, done: Callable[[Matches], MatchCard | None], within_s: float
) -> MatchCard:
    lists = await bus.subscribe(MATCHES_KEY, Delivery.STATE, depth=1)
    orders = await bus.publisher(order_key(order.number), Delivery.SPEECH)
    sending = asyncio.create_task(_send(orders.put, encode(order)))
    try:
        async with asyncio.timeout(within_s):
            while (card := done(await _newest(lists, within_s))) is None:
                pass
    except TimeoutError:
        raise NoService(
            f"the service did not obey within {within_s:g} s; with --tls only the certificate of a host may give orders"
        ) from None
    else:
        return card
    finally:
        sending.cancel()
        await asyncio.wait([sending])
        await orders.close()
        await lists.close()


async def _send(put: Callable[[bytes], Awaitable[None]], payload: bytes) -> None:
    while True:
        await put(payload)
        await asyncio.sleep(AGAIN_S)


async def _newest(lists: Subscription[Sample], within_s: float | None) -> Matches:
    try:
        async with asyncio.timeout(within_s):
            return decode_as(Matches, (await anext(lists)).payload)
    except TimeoutError:
        raise NoService(
            f"no service answers here within {within_s:g} s: `khala serve` starts one, --connect says where it is"
        ) from None
    except StopAsyncIteration:
        raise NoService("the link to the service was lost") from None


async def _show(samples: Subscription[Sample], show: Callable[[Wire], None]) -> None:
    async for sample in samples:
        with contextlib.suppress(PeerError):
            show(decode(sample.payload))


def _with_number(matches: Matches, number: str) -> MatchCard | None:
    return next((card for card in matches.matches if card.number == number), None)


def _over(matches: Matches, run: str) -> MatchCard | None:
    card = find(matches, run)
    return None if card.state in OPEN else card
