"""What SIGINT and SIGTERM do to a command: they end its work in order.

Above: the command lines of all parts. Both functions are called on the loop that does the work.
"""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, TypeVar

from khala_protocol.platforms import on_signals

if TYPE_CHECKING:
    import signal
    from collections.abc import Coroutine

T = TypeVar("T")


def stop_on_signal() -> asyncio.Event:
    """Return an event that the first signal sets; the second one ends the process at once."""
    stop = asyncio.Event()

    def end(_: signal.Signals) -> None:
        stop.set()
        undo()

    undo = on_signals(end)
    return stop


async def cancelled_by_signal(work: Coroutine[Any, Any, T]) -> T | signal.Signals:
    """Return the result of `work`, or the first signal if one cancelled it."""
    task = asyncio.ensure_future(work)
    came: list[signal.Signals] = []

    def end(number: signal.Signals) -> None:
        came.append(number)
        task.cancel()

    on_signals(end)
    try:
        return await task
    except asyncio.CancelledError:
        if came:
            return came[0]
        raise
