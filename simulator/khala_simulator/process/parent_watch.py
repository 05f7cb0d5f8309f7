"""Exit when the parent process is gone: at once if it is known to be the client, else a minute after the last client.

A killed client (SIGKILL, the out-of-memory killer) does not end its game, and the next client starts another one, so
that games would pile up. A parent that is the only client says so in `KHALA_PARENT`. Of any other parent nothing is
known: a game that was started by hand lives as long as the shell that started it, or its clients.
"""

from __future__ import annotations

import asyncio
import os
import threading
from typing import TYPE_CHECKING

from khala_simulator.process.platforms import living_parent, wait_for_end_of

if TYPE_CHECKING:
    from collections.abc import Callable

PARENT = "KHALA_PARENT"
"""The variable with the process id of the parent; without that parent no client needs the game."""
LOOK_S = 5.0
PATIENCE_LOOKS = 12
"""Clients may drop a connection and open another: PySC2's remote agents do so three times."""


def end_with_parent() -> None:
    """End this process as soon as the parent is gone that the environment names; there is nothing to save."""
    parent = os.environ.get(PARENT, "")
    if parent.isdigit():
        threading.Thread(target=_watch, args=(int(parent),), name="parent watch", daemon=True).start()


def _watch(parent: int) -> None:
    # A thread: in the middle of a thousand steps the event loop would look too late.
    wait_for_end_of(parent)
    os._exit(1)


async def wait_until_orphaned(
    has_client: Callable[[], bool], *, parent: Callable[[], int] = living_parent, look_s: float = LOOK_S
) -> None:
    """Wait until the process has lost its parent and no client has been connected for `PATIENCE_LOOKS` looks.

    Args:
        has_client: whether a client is connected now.
        parent: process id of the parent; another process takes the place of a dead one.
        look_s: seconds between two looks.
    """
    born_to = parent()
    alone = 0
    while alone < PATIENCE_LOOKS:
        await asyncio.sleep(look_s)
        alone = 0 if parent() == born_to or has_client() else alone + 1
