"""Decide where a `put` runs: on the loop if it cannot block, on a thread if it could.

A put on the loop costs 5 to 25 µs, one through a thread 150 µs and more; but a put into a full queue holds its thread
until the link takes something. The time depends on its congestion control: half a second under BLOCK, which then
closes the link; `WAIT_BEFORE_DROP_S` under DROP.
"""

from __future__ import annotations

import asyncio
import threading
import time
from typing import TYPE_CHECKING, Protocol

from khala_protocol.bus.config import BATCH_BYTES, TX_SLOTS

if TYPE_CHECKING:
    from collections.abc import Callable
    from concurrent.futures import Executor, Future

    Ask = Callable[[Callable[[bool], None]], None]

WINDOW_BYTES = TX_SLOTS // 2 * BATCH_BYTES - BATCH_BYTES // 2
"""Bytes that surely fit into a queue. A sample that does not fit into the current batch starts the next: two adjacent
batches hold more than one is large, and all of them more than half; the rest is for the question and for headers."""
HEADER_BYTES = 200
SLOW_S = 0.002


class Gate(Protocol):
    """The decision whether a put may run on the loop."""

    def fits(self, size: int) -> bool:
        """Return whether a put of `size` bytes cannot block now."""
        ...

    def sent(self, size: int, took_s: float) -> None:
        """Note a put."""
        ...


class Lane:
    """A queue that runs puts in the order in which they are given, each on the loop or on a thread.

    Args:
        thread: an executor with one worker; several lanes may share it.
        gate: decides.
    """

    def __init__(self, thread: Executor, gate: Gate) -> None:
        self._thread = thread
        self._gate = gate
        self._under_way: set[Future[float]] = set()

    async def put(self, put: Callable[[bytes], None], payload: bytes) -> None:
        """Call `put(payload)` and return when it has returned. If cancelled while waiting, the put may still happen."""
        size = len(payload) + HEADER_BYTES
        if self._under_way or not self._gate.fits(size):
            future = self._thread.submit(_time, put, payload)
            self._under_way.add(future)
            future.add_done_callback(self._under_way.discard)
            took_s = await asyncio.wrap_future(future)
        else:
            took_s = _time(put, payload)
        self._gate.sent(size, took_s)

    async def settle(self) -> None:
        """Return when no put is under way, those whose callers were cancelled included."""
        if under_way := [asyncio.wrap_future(future) for future in tuple(self._under_way)]:
            await asyncio.wait(under_way)


class Window:
    """The gate of puts that BLOCK: open while all bytes that are still on their way would fit into an empty queue.

    The kernel's buffers come on top: with them empty, 225 puts of 20 kB went through before the first one blocked; with
    them full, 32. A question that follows a put through the same queue shows that it has arrived.

    Args:
        ask: sends a question behind the puts. It calls back once, on any thread, and says whether an answer came.
    """

    def __init__(self, ask: Ask) -> None:
        self._ask = ask
        self._lock = threading.Lock()  # guards what follows; not held while asking
        self._in_flight = 0
        self._asking = False

    def fits(self, size: int) -> bool:
        """See `Gate`."""
        with self._lock:
            return self._in_flight + size <= WINDOW_BYTES

    def sent(self, size: int, took_s: float) -> None:  # noqa: ARG002  the signature of a gate
        """See `Gate`; asks when a quarter of the window is used."""
        with self._lock:
            self._in_flight += size
            if self._asking or self._in_flight < WINDOW_BYTES // 4:
                return
            self._asking = True
            asked = self._in_flight
        self._ask(lambda answered: self._acknowledge(asked if answered else 0))

    def _acknowledge(self, size: int) -> None:
        with self._lock:
            self._asking = False
            self._in_flight -= size


class DropGate:
    """The gate of puts that DROP: open for samples that fit into one batch; shut after a slow put until a quick one."""

    def __init__(self) -> None:
        self._slow = False

    def fits(self, size: int) -> bool:
        """See `Gate`."""
        return size <= BATCH_BYTES and not self._slow

    def sent(self, size: int, took_s: float) -> None:  # noqa: ARG002  the signature of a gate
        """See `Gate`."""
        self._slow = took_s > SLOW_S


class Shut:
    """The gate for links without news of arrivals."""

    def fits(self, size: int) -> bool:  # noqa: ARG002  a gate is asked
        """See `Gate`."""
        return False

    def sent(self, size: int, took_s: float) -> None:
        """See `Gate`."""


def _time(put: Callable[[bytes], None], payload: bytes) -> float:
    start = time.perf_counter()
    put(payload)
    return time.perf_counter() - start
