"""The experiments of a directory, as a list shows them: without the code that plays and measures them.

How many matches one plans is counted once for each state of its file, and kept with what is known of recordings.
"""

from __future__ import annotations

import contextlib
import sqlite3
from typing import TYPE_CHECKING

from khala_protocol.errors import KhalaError
from khala_sc2.view.library import EXPERIMENT, cache
from khala_sc2.view.wire import ExperimentLine

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


def list_experiments(directories: Sequence[Path]) -> list[ExperimentLine]:
    """Return the lines of experiments; how many matches each plans is known until its file changes."""
    with contextlib.closing(cache()) as db:
        return [line for path in directories if (line := _experiment(path, db)) is not None]


def _experiment(directory: Path, db: sqlite3.Connection) -> ExperimentLine | None:
    try:
        changed = (directory / EXPERIMENT).stat().st_ctime_ns
        key = str(directory.absolute())
        known = db.execute("select line from line where path = ? and changed_ns = ?", (key, changed)).fetchone()
        with contextlib.suppress(sqlite3.Error):  # an index that is broken is made again below
            if known:
                return ExperimentLine.model_validate_json(known[0]).but(played=_count_played(directory))
        from khala_sc2.view.table import line_of  # noqa: PLC0415  # it loads all that experiments need

        line = line_of(directory)
        db.execute("insert or replace into line values (?, 0, ?, ?)", (key, changed, line.model_dump_json()))
    except (KhalaError, OSError, ValueError, sqlite3.Error):
        return None
    return line


def _count_played(directory: Path) -> int:
    path = directory / "index.sqlite"
    if not path.exists():
        return 0
    if not path.is_file():  # a pipe would be waited for
        raise sqlite3.DatabaseError("it is no file")
    with contextlib.closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as db:
        if db.execute("select type from sqlite_master where name = 'matches'").fetchone() != ("table",):
            raise sqlite3.DatabaseError("it is of somebody else, and a view may count for ever")
        count: int = db.execute("select count(*) from matches").fetchone()[0]
        return count
