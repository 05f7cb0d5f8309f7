"""Run work that may block for seconds where it blocks neither the loop nor the end of the process.

The loop's own executor would not do: the loop and the process wait for its threads when they end.
"""

from __future__ import annotations

import asyncio
import threading
from concurrent.futures import Future
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")


async def run_detached(work: Callable[[], T]) -> T:
    """Call `work` on its own daemon thread; if this is cancelled, the thread goes on and its result is lost."""
    future: Future[T] = Future()

    def run() -> None:
        if not future.set_running_or_notify_cancel():
            return
        try:
            future.set_result(work())
        except Exception as error:  # noqa: BLE001  it is raised where it is awaited
            future.set_exception(error)

    threading.Thread(target=run, name="khala-bus", daemon=True).start()
    return await asyncio.wrap_future(future)
