"""Ports for the processes of the game, which no outgoing connection takes before the game listens.

PySC2 asks the operating system for a free port and names it to the game, which listens a moment later. The system gives
ports of the same range to every outgoing connection, so the port is now and then taken in between, and the game cannot
start. Here ports come from below that range. Above: `khala_bridge.game.processes`, `env` and `meeting`.
"""

from __future__ import annotations

import random

from khala_bridge.compat import portpicker
from khala_bridge.errors import GameError

_RANGE = range(15_000, 25_000)
"""Outgoing connections leave from 32768 upwards on Linux, from 49152 upwards on macOS and Windows."""
_TRIES = 100
_random = random.SystemRandom()  # matches of one seed must not pick the same ports


def pick_port() -> int:
    """Return a port that is free for TCP and UDP; errors as in `pick_ports`."""
    return pick_ports(1)[0]


def pick_ports(number: int) -> list[int]:
    """Return so many ports in a row that are free for TCP and UDP.

    Raises:
        GameError: none were found.
    """
    for _ in range(_TRIES):
        first = _random.choice(_RANGE[: len(_RANGE) - number + 1])
        ports = list(range(first, first + number))
        if all(portpicker.is_port_free(port) for port in ports):
            return ports
    raise GameError(f"no {number} free ports in a row from {_RANGE.start} to {_RANGE.stop - 1}: end some programs")
