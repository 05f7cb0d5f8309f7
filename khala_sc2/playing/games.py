"""Which game plays: the simulator, unpacked into the user's cache, or the StarCraft II of this machine."""

from __future__ import annotations

import os
from pathlib import Path

from khala_bridge.errors import GameMissing
from khala_bridge.game.game import find_sc2
from khala_sc2 import __version__
from khala_simulator.native.engine import describe
from khala_simulator.process.install import InstallError, install, is_installed

STARCRAFT = "StarCraft II"


def cache() -> Path:
    """Return where the simulator is unpacked: `$KHALA_CACHE`, or the user's cache directory."""
    if given := os.environ.get("KHALA_CACHE"):
        return Path(given).expanduser()
    return Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "khala"


def find(source: str) -> tuple[Path, str]:
    """Return the directory for SC2PATH, and the name for the run card.

    Args:
        source: `simulator`, `starcraft2`, or a directory that holds either of them.

    Raises:
        GameMissing: it is not there, or the simulator cannot be unpacked; the text says what to do.
    """
    if source == "simulator":
        try:
            path = find_sc2(source, simulator=install(cache() / "StarCraftII"))
        except InstallError as error:
            raise GameMissing(f"the simulator cannot be laid out: {error}; KHALA_CACHE names another place") from None
    else:
        path = find_sc2(source)
    return path, _simulator() if is_installed(path) else STARCRAFT


def name_of(source: str) -> str:
    """Return the name of a game for the run card, and do not unpack the simulator for it; errors as in `find`."""
    return _simulator() if source == "simulator" else find(source)[1]


def _simulator() -> str:
    return f"Khala simulator {__version__} ({describe()}), as"
