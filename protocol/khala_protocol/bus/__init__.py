"""The bus: bytes under keys, with promises. Two implementations keep the same promises and pass the same tests.

`khala_protocol.bus.memory.MemoryBus` lives in one process and is what tests use; `khala_protocol.bus.zenoh.ZenohBus`
joins machines. The tests are shipped, `khala_protocol.bus.testing`. Nothing here knows what the bytes mean
(`khala_protocol.codec` does) or how keys are built (`khala_protocol.keys` does). Everything runs on one asyncio loop;
nothing of a bus may be touched from another thread, or after a fork.

    ┌──────────┬─────────────────────────────────────┬──────────────────────┬──────────────────────────────┐
    │ Delivery │ used for                            │ a slow receiver      │ a receiver that joins later  │
    ├──────────┼─────────────────────────────────────┼──────────────────────┼──────────────────────────────┤
    │ STATE    │ briefing, observation, image, run,  │ loses old ones, is   │ gets the newest at once, and │
    │          │ result                              │ told how many; never │ after a lost link the newest │
    │          │                                     │ slows anybody down   │ it missed                    │
    │ SPEECH   │ reply, message                      │ the sender waits,    │ gets nothing from before     │
    │          │                                     │ half a second at most│                              │
    │ LOG      │ exchange, report                    │ loses, silently      │ gets nothing from before     │
    └──────────┴─────────────────────────────────────┴──────────────────────┴──────────────────────────────┘

Slow is a link that is full or a process that stands still. A process that only does not take what arrived never slows a
sender: its subscriptions keep the newest `depth` items and count the rest.

Samples of one publisher arrive in order and at most once; so do the samples of all SPEECH publishers of one bus,
whatever their keys, in the order in which their puts returned. This is why a reply may be taken as the end of the
messages sent before it. No promise covers a link that is down: whoever needs an answer correlates and counts.
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
        alive: False when the session that declared it closed, died (told within 50 ms) or was cut off or stopped (told
            within the lease of its link, 2.5 s by default).
        link_up: False when it is our own link that is down, so that the other side may well be alive. When our link is
            back, those that are still there are reported `alive` again; of the others nothing more is heard.
    """

    key: str
    alive: bool
    link_up: bool = True


class Publisher(Protocol):
    """Puts bytes under one key."""

    @property
    def key(self) -> str:
        """The key that it was declared for."""
        ...

    async def put(self, payload: bytes) -> None:
        """Sends `payload`; returns when it is on its way, which is no proof of arrival.

        A put that is cancelled may still be sent.

        Raises:
            BusClosed: the bus or the publisher is closed.
        """
        ...

    async def close(self) -> None:
        """Undeclares the publisher; its cache is forgotten. May be called twice."""
        ...


class Subscription(Protocol[T_co]):
    """What arrives, as an asynchronous iterator that ends when the subscription or the bus is closed.

    What had arrived before is still handed out after that. A wait that is cancelled loses nothing.

    Attributes:
        dropped: items that arrived and were thrown away here, because nobody took them in time.
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
        """Iterates over what arrives."""
        ...

    async def __anext__(self) -> T_co:
        """The next item; waits for it."""
        ...

    async def close(self) -> None:
        """Undeclares the subscription and ends the iteration. May be called twice."""
        ...


class Token(Protocol):
    """A liveliness token: it is seen by watchers as long as it is open and our link is up."""

    async def close(self) -> None:
        """Takes the token back. May be called twice."""
        ...


class Bus(Protocol):
    """A session on the bus."""

    async def publisher(self, key: str, delivery: Delivery) -> Publisher:
        """Declares a publisher for one key. It is open until it or the bus is closed, even if nobody refers to it.

        Raises:
            BusClosed: the bus is closed.
            WrongKey: this is no key.
        """
        ...

    async def subscribe(self, key_expr: str, delivery: Delivery, *, depth: int = 1024) -> Subscription[Sample]:
        """Declares a subscription; samples put after this returns arrive (and see `Delivery`).

        Args:
            key_expr: a key, or an expression with `*` (one part) and `**` (any number of parts).
            delivery: as the publishers of these keys declare it; STATE if they differ, which hears them all.
            depth: samples that wait here before the oldest is dropped; 1 keeps the newest only.

        Raises:
            BusClosed: the bus is closed.
            WrongKey: this is no key expression.
            ValueError: `depth` is less than 1.
        """
        ...

    async def announce(self, key: str) -> Token:
        """Declares a liveliness token. Two of one key look like one, so that a key names an instance.

        Raises:
            BusClosed: the bus is closed.
            WrongKey: this is no key.
        """
        ...

    async def watch(self, key_expr: str, *, depth: int = 1024) -> Subscription[Liveness]:
        """Reports tokens: those that are there already at first, then every change.

        Raises:
            BusClosed: the bus is closed.
            WrongKey: this is no key expression.
        """
        ...

    async def close(self) -> None:
        """Closes everything that was declared here, after what was put; within two seconds. May be called twice."""
        ...
