"""Decides where a `put` runs: on the loop while it cannot block, on a thread when it could.

A put on the loop costs 25 µs, one through a thread 150 µs and more; but a put into a full queue holds its thread until
the link takes something, half a second at most under congestion control BLOCK. A link has `TX_SLOTS` slots per
priority, and the kernel's buffers behind them (300 slots before the first blocked put was measured with 20 kB, exactly
16 when the buffers were full): with fewer batches than that on their way, a put cannot block. What tells that they have
arrived is a question that follows them through the same queue; one small question serves several puts.
"""

from __future__ import annotations

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Protocol

from protocol.bus.config import TX_SLOTS

if TYPE_CHECKING:
    from collections.abc import Callable

    Ask = Callable[[Callable[[bool], None]], None]

BATCH_BYTES = 60_000
"""A little less than Zenoh's batch of 65535 bytes; a larger payload is cut into several."""
WINDOW_SLOTS = TX_SLOTS - 4
"""The rest is for the questions."""


class Gate(Protocol):
    """Tells whether a put may run on the loop."""

    def fits(self, slots: int) -> bool:
        """Whether a put of `slots` batches cannot block now."""
        ...

    def sent(self, slots: int) -> None:
        """Takes note of a put of `slots` batches."""
        ...


class Lane:
    """Runs puts in the order in which they are given, each on the loop or on one thread of its own."""

    def __init__(self, name: str, gate: Gate) -> None:
        self._gate = gate
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix=name)
        self._waiting = 0

    async def put(self, put: Callable[[bytes], None], payload: bytes) -> None:
        """Calls `put(payload)` and returns when it has returned. Cancelled while it waits, the put may still happen."""
        slots = 1 + len(payload) // BATCH_BYTES
        if self._waiting or not self._gate.fits(slots):
            self._waiting += 1
            try:
                await asyncio.get_running_loop().run_in_executor(self._thread, put, payload)
            finally:
                self._waiting -= 1
        else:
            put(payload)
        self._gate.sent(slots)

    def close(self) -> None:
        """Waits for the puts that were given; it blocks."""
        self._thread.shutdown(wait=True)


class Window:
    """The gate of puts that block: open while no more than `WINDOW_SLOTS` batches have not been acknowledged.

    Args:
        ask: sends a question behind the puts of this lane. It calls back once, on any thread, and says whether an
            answer came.
    """

    def __init__(self, ask: Ask) -> None:
        self._ask = ask
        self._lock = threading.Lock()  # guards what follows; not held while asking
        self._in_flight = 0
        self._asking = False

    def fits(self, slots: int) -> bool:
        """See `Gate`."""
        with self._lock:
            return self._in_flight + slots <= WINDOW_SLOTS

    def sent(self, slots: int) -> None:
        """See `Gate`; asks when a third of the window is used."""
        with self._lock:
            self._in_flight += slots
            if self._asking or self._in_flight < WINDOW_SLOTS // 3:
                return
            self._asking, asked = True, self._in_flight
        self._ask(lambda answered: self._acknowledge(asked if answered else 0))

    def _acknowledge(self, slots: int) -> None:
        with self._lock:
            self._asking = False
            self._in_flight -= slots


class OneBatch:
    """The gate of puts that drop: a batch waits 1 ms for a slot, a payload of several 50 ms for all of them."""

    def fits(self, slots: int) -> bool:
        """See `Gate`."""
        return slots == 1

    def sent(self, slots: int) -> None:
        """See `Gate`."""


class Shut:
    """The gate where nothing tells what has arrived."""

    def fits(self, slots: int) -> bool:  # noqa: ARG002  a gate is asked
        """See `Gate`."""
        return False

    def sent(self, slots: int) -> None:
        """See `Gate`."""
