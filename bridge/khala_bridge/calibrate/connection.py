"""A process of the game and its raw API, without the environment of PySC2 around it.

Above: `khala_bridge.calibrate.lab` and `khala_bridge.calibrate.survey`. Below: `khala_bridge.game.processes`, which
starts a process of any install on any system.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any, Protocol

from s2clientprotocol import sc2api_pb2 as sc

from khala_bridge.game.processes import explain_errors, new_process

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


class Connection(Protocol):
    """One client of a game."""

    def send(self, **request: Any) -> Any:
        """Send one request, given as `kind=message`, and return the body of its response.

        Raises:
            GameError: the game refused it, or is gone.
        """


class ProcessConnection:
    """The connection to a process that PySC2 started."""

    def __init__(self, client: Any) -> None:
        """Take PySC2's client of the protocol."""
        self._client = client

    def send(self, **request: Any) -> Any:
        """See `Connection`."""
        (kind,) = request
        with explain_errors(f"the game did not answer {kind}"):
            return self._client.send(**request)


@contextlib.contextmanager
def run_game(sc2path: Path, environment: dict[str, str] | None = None) -> Iterator[ProcessConnection]:
    """Start the game of an install, and end it.

    Raises:
        GameMissing: there is no game.
        GameError: it could not be started.
    """
    with explain_errors("the game could not be started"):
        process = new_process(sc2path, environment)
    try:
        yield ProcessConnection(process.controller._client)  # noqa: SLF001  # its own methods check a status of their own
    finally:
        with contextlib.suppress(Exception):  # it may be dead already
            process.close()


def version(connection: Connection) -> tuple[str, int, str]:
    """Return the game's version, its base build and the version of its data."""
    ping = connection.send(ping=sc.RequestPing())
    return ping.game_version, ping.base_build, ping.data_version
