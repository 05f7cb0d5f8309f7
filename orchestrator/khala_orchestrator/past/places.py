"""Which recording a name on the command line stands for: a recording, a run below `runs`, or a directory.

Above: `khala replay`, and `khala view`, which lists a directory with several recordings instead.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from pathlib import Path


def place_of(name: Path, runs: Path) -> Path:
    """Return the file or directory of this name, here or else below `runs`.

    Raises:
        ConfigError: there is neither.
    """
    with contextlib.suppress(OSError, ValueError):  # a name that no file can have
        for path in (name, runs / name):
            if path.exists():
                return path
    raise ConfigError(f"there is no {name}, nor {runs / name}: name a recording, a directory or a run")


def recording_of(name: Path, runs: Path) -> Path:
    """Return the recording of this name; of a directory, the one that was written last, in it or below it.

    Raises:
        ConfigError: there is none.
    """
    place = place_of(name, runs)
    if not place.is_dir():
        return place
    found = [(path.stat().st_mtime_ns, path) for path in place.rglob("*.mcap") if path.is_file()]
    if not found:
        raise ConfigError(f"there is no recording in {place}: name another directory, or play with `khala run`")
    return max(found)[1]
