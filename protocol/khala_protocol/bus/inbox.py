"""A bounded mailbox: items from any thread wait here until the loop takes them, or the oldest is dropped.

Both buses use mailboxes as their subscriptions. Only `depth` bounds the memory: an unbounded
`call_soon_threadsafe` per sample held 407 MB after 2000 samples of 200 kB to a busy loop. A burst to any number of
mailboxes wakes the loop once: with 64 agents in a process, that takes a quarter of the time of a round.
"""

from __future__ import annotations

import asyncio
import threading
from collections import deque
from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

T = TypeVar("T")


class Doorbell:
    """A bell that wakes the loop that it was made on, for any number of mailboxes."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._calls: deque[Callable[[], None]] = deque()
        self._ringing = False

    def ring(self, call: Callable[[], None]) -> None:
        """Have `call` called on the loop soon. From any thread; never block and never raise."""
        self._calls.append(call)
        if self._ringing:  # `_answer` has not begun yet, and will find it
            return
        self._ringing = True
        try:
            self._loop.call_soon_threadsafe(self._answer)
        except RuntimeError:  # the loop is closed: nothing will read this any more
            self._calls.clear()

    def _answer(self) -> None:
        self._ringing = False
        while self._calls:
            self._calls.popleft()()


class Inbox(Generic[T]):
    """A `khala_protocol.bus.Subscription` of the items given to `offer` or `offer_from_thread`.

    Made on the loop that iterates over it. Items that arrived before `close` are still delivered after it.

    Attributes:
        dropped: items discarded because `depth` of them were waiting already.
        missed: samples that never arrived, as far as the owner of the mailbox knows.
    """

    def __init__(
        self, depth: int, *, on_close: Callable[[], None] | None = None, doorbell: Doorbell | None = None
    ) -> None:
        if depth < 1:
            raise ValueError(f"depth must be at least 1, not {depth}")
        self.dropped = 0
        self.missed = 0
        self._on_close = on_close
        self._doorbell = doorbell or Doorbell()
        self._lock = threading.Lock()  # guards what follows; never held across a call of foreign code
        self._items: deque[T] = deque(maxlen=depth)
        self._waking = False
        self._closed = False
        self._arrived = asyncio.Event()

    def offer(self, item: T) -> None:
        """Put an item in, on the loop's own thread."""
        with self._lock:
            self._append(item)
        self._arrived.set()

    def offer_from_thread(self, item: T) -> None:
        """Put an item in from any thread. Never block and never raise."""
        with self._lock:
            self._append(item)
            if self._waking:
                return
            self._waking = True
        self._doorbell.ring(self._wake)

    def miss(self, count: int) -> None:
        """Add to `missed`, from any thread."""
        with self._lock:
            self.missed += count

    def shut(self) -> None:
        """End the iteration without notifying the owner; on the loop's own thread."""
        self._closed = True
        self._arrived.set()

    async def close(self) -> None:
        """End the iteration and notify the owner. May be called twice."""
        if self._closed:
            return
        self.shut()
        if self._on_close is not None:
            self._on_close()

    def __aiter__(self) -> AsyncIterator[T]:
        return self

    async def __anext__(self) -> T:
        while True:
            with self._lock:
                if self._items:
                    return self._items.popleft()
            if self._closed:
                raise StopAsyncIteration
            self._arrived.clear()
            await self._arrived.wait()

    def _append(self, item: T) -> None:
        if self._closed:
            return
        if len(self._items) == self._items.maxlen:
            self.dropped += 1
        self._items.append(item)

    def _wake(self) -> None:
        with self._lock:
            self._waking = False
        self._arrived.set()
