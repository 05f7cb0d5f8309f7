"""Exit when the parent process is gone and no client is connected for a minute.

A killed client (SIGKILL, the out-of-memory killer) does not end its game, and the next client starts another one, so
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
    """Wait until the process has lost its parent and no client has been connected for `PATIENCE_LOOKS` looks.

    Args:
        has_client: whether a client is connected now.
        parent: process id of the parent; another process takes the place of a dead one.
        look_s: seconds between two looks.
    """
    born_to, alone = parent(), 0
    while alone < PATIENCE_LOOKS:
        await asyncio.sleep(look_s)
        alone = 0 if parent() == born_to or has_client() else alone + 1
