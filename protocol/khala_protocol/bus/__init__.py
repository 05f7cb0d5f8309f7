"""The bus: bytes under keys, with promises. Two implementations keep the same promises and pass the same tests.

`khala_protocol.bus.memory.MemoryBus` lives in one process and is for tests; `khala_protocol.bus.zenoh.ZenohBus`
joins machines. The tests are shipped, `khala_protocol.bus.testing`. Nothing here knows what the bytes mean
(`khala_protocol.codec` does) or how keys are built (`khala_protocol.keys` does). Everything runs on one asyncio loop;
nothing of a bus may be touched from another thread, or after a fork.

    ┌──────────┬─────────────────────────────────────┬──────────────────────┬──────────────────────────────┐
    │ Delivery │ used for                            │ a slow receiver      │ a receiver that joins later  │
    ├──────────┼─────────────────────────────────────┼──────────────────────┼──────────────────────────────┤
    │ STATE    │ briefing, observation, image, run,  │ loses old ones, is   │ gets the newest at once, and │
    │          │ result, terrain, scene              │ counts them; never   │ after a lost link the newest │
    │          │                                     │ slows a sender down  │ it missed                    │
    │ SPEECH   │ reply, advice                       │ the sender waits,    │ gets nothing from before     │
    │          │                                     │ half a second at most│                              │
    │ LOG      │ exchange, message, report           │ loses, silently      │ gets nothing from before     │
    └──────────┴─────────────────────────────────────┴──────────────────────┴──────────────────────────────┘

A link is slow if it is full, a process if it stands still. A process that only does not read what arrived never slows
a sender: its subscriptions keep the newest `depth` items and count the rest.

Samples of one publisher arrive in order and at most once; so do the samples of all SPEECH publishers of one bus,
whatever their keys, in the order in which their puts returned. This is why a reply may be taken as the end of the
messages sent before it. No promise covers a link that is down: a peer that needs an answer correlates and counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Protocol, TypeVar

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

T_co = TypeVar("T_co", covariant=True)


class Delivery(Enum):
    """What a publisher promises; see the table of the module."""

    STATE = "state"
    SPEECH = "speech"
    LOG = "log"


@dataclass(frozen=True, slots=True)
class Sample:
    """Bytes that arrived under a key."""

    key: str
    payload: bytes


@dataclass(frozen=True, slots=True)
class Liveness:
    """A liveliness token appeared (`alive`) or went away.

    Attributes:
        key: the token's key.
        alive: False when the session that declared it closed, died (reported within 50 ms) or was cut off or stopped
            (reported within the lease of its link, 2.5 s by default).
        link_up: False when our own link is down, so that the other side may well be alive. When our link is
            back, those that are still there are reported `alive` again; the others are not reported again.
    """

    key: str
    alive: bool
    link_up: bool = True


class Publisher(Protocol):
    """A publisher of bytes under one key."""

    @property
    def key(self) -> str:
        """The declared key."""
        ...

    async def put(self, payload: bytes) -> None:
        """Send `payload`; return when it is on its way, which does not prove its arrival.

        A put that is cancelled may still be sent.

        Raises:
            BusClosed: the bus or the publisher is closed.
        """
        ...

    async def close(self) -> None:
        """Undeclare the publisher and discard its cache. May be called twice."""
        ...


class Subscription(Protocol[T_co]):
    """What arrives, as an asynchronous iterator that ends when the subscription or the bus is closed.

    Items that arrived before that are still delivered after it. A cancelled wait loses nothing.

    Attributes:
        dropped: items that arrived and were discarded here, because they were not read in time.
        missed: samples that a STATE publisher sent and that never arrived here, as far as is known.
    """

    @property
    def dropped(self) -> int:
        """See the class."""
        ...

    @property
    def missed(self) -> int:
        """See the class."""
        ...

    def __aiter__(self) -> AsyncIterator[T_co]:
        """Iterate over what arrives."""
        ...

    async def __anext__(self) -> T_co:
        """Wait for the next item and return it."""
        ...

    async def close(self) -> None:
        """Undeclare the subscription and end the iteration. May be called twice."""
        ...


class Token(Protocol):
    """A liveliness token: watchers see it as long as it is open and our link is up."""

    async def close(self) -> None:
        """Take the token back. May be called twice."""
        ...


class Bus(Protocol):
    """A session on the bus."""

    async def publisher(self, key: str, delivery: Delivery) -> Publisher:
        """Declare a publisher for one key. It is open until it or the bus is closed, even if nothing refers to it.

        Raises:
            BusClosed: the bus is closed.
            WrongKey: this is no key.
        """
        ...

    async def subscribe(self, key_expr: str, delivery: Delivery, *, depth: int = 1024) -> Subscription[Sample]:
        """Declare a subscription; samples put after this returns arrive (and see `Delivery`).

        Args:
            key_expr: a key, or an expression with `*` (one part) and `**` (any number of parts).
            delivery: as the publishers of these keys declare it; STATE if they differ, which hears them all.
            depth: samples that wait here before the oldest is dropped; 1 keeps only the newest.

        Raises:
            BusClosed: the bus is closed.
            WrongKey: this is no key expression.
            ValueError: `depth` is less than 1.
        """
        ...

    async def announce(self, key: str) -> Token:
        """Declare a liveliness token. Two tokens of one key look like one, so a key should name an instance.

        Raises:
            BusClosed: the bus is closed.
            WrongKey: this is no key.
        """
        ...

    async def watch(self, key_expr: str, *, depth: int = 1024) -> Subscription[Liveness]:
        """Report tokens: first those that are there already, then every change.

        Raises:
            BusClosed: the bus is closed.
            WrongKey: this is no key expression.
        """
        ...

    async def close(self) -> None:
        """Close everything that was declared here, after all puts; within two seconds. May be called twice."""
        ...
