"""Games of the simulator in this process: no process to start, no socket, and the memory of a world alone.

A game here is the one that the simulator's process would play, request by request. It holds Python's lock while it
computes, so all games of a process share one core. A fault of the simulator is an answer, and ends its own match; what
the process itself does not survive ends all of its games.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

from khala_bridge.game.inside import InsideProcess
from khala_bridge.game.processes import IdleGames
from khala_sc2.playing.games import find
from khala_simulator.process.install import installed_version, is_installed
from khala_simulator.process.session import Session
from khala_simulator.tables.versions import BUILD_OF_VERSION

if TYPE_CHECKING:
    from pathlib import Path


def games_of(game: str, most: int) -> InsideGames | IdleGames:
    """Return where many matches get their games: in this process, or processes of a real game, of which some wait.

    Args:
        game: `simulator`, `starcraft2`, or a directory.
        most: processes that wait.

    Raises:
        GameMissing: it is not there.
    """
    path, _ = find(game)
    return InsideGames() if is_installed(path) else IdleGames(most)


class InsideGames:
    """Makes a game for each match that asks, if it is to be played on the simulator: see `Processes`.

    Its games share two threads: the lock lets no more than one compute, and each thread keeps 10 MB of freed memory.
    """

    def __init__(self) -> None:
        self.threads = ThreadPoolExecutor(max_workers=2, thread_name_prefix="games")

    def take(self, sc2path: Path) -> Any:
        """Return a game of the simulator that is installed there; None if another game is."""
        version = installed_version(sc2path)
        if version is None:
            return None
        session = Session(sc2path, BUILD_OF_VERSION[version])
        return InsideProcess(session.handle)

    def keep(self, process: Any, sc2path: Path) -> bool:  # noqa: ARG002  # see `Processes`
        """Return False: a new one costs nothing."""
        return False

    def began(self) -> None:
        """Do nothing: none was made ahead."""

    def close(self) -> None:
        """Do nothing: a game ends with its match, and the threads when no match has them any more."""
