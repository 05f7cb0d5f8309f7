"""Exit when the parent process is gone and no client is connected for a minute.

A client that is killed (SIGKILL, the out-of-memory killer) ends no game, and the next one starts a game of its own, so
that games would pile up. A game that was started by hand lives as long as the shell that started it, or its clients.
"""

from __future__ import annotations

import asyncio
import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

LOOK_S = 5.0
PATIENCE_LOOKS = 12
"""Clients may drop a connection and open another: PySC2's remote agents do so three times."""


async def orphaned(
    has_client: Callable[[], bool], *, parent: Callable[[], int] = os.getppid, look_s: float = LOOK_S
) -> None:
    """Returns when the process has lost its parent and nobody has been connected for `PATIENCE_LOOKS` looks.

    Args:
        has_client: whether a client is connected now.
        parent: process id of the parent; another process takes the place of a dead one.
        look_s: seconds between two looks.
    """
    born_to, alone = parent(), 0
    while alone < PATIENCE_LOOKS:
        await asyncio.sleep(look_s)
        alone = 0 if parent() == born_to or has_client() else alone + 1
