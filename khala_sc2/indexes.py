"""SQLite files that hold nothing of their own: whatever is wrong with one, it is made again from what it is about.

An index may be torn, of another version of Khala, of somebody else, or no file at all. `connect` takes none of these,
and does not run what a foreign one holds. A full disk is no fault of an index: `faults` raises it as an `OSError`.
"""

from __future__ import annotations

import contextlib
import errno
import os
import re
import sqlite3
import tempfile
from typing import TYPE_CHECKING

from khala_protocol.platforms import NO_FOLLOW

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

BUSY_S = 30.0
"""How long another process may write."""
_BESIDE = ("-journal", "-wal", "-shm")
"""Ends of the names of what SQLite keeps beside a file. An old journal would be played into a new file."""
_MACHINE = {
    sqlite3.SQLITE_FULL: errno.ENOSPC,
    sqlite3.SQLITE_IOERR: errno.EIO,
    sqlite3.SQLITE_READONLY: errno.EROFS,
    sqlite3.SQLITE_CANTOPEN: errno.EACCES,
    sqlite3.SQLITE_PERM: errno.EACCES,
    sqlite3.SQLITE_BUSY: errno.EBUSY,
    sqlite3.SQLITE_LOCKED: errno.EBUSY,
}
"""Faults of the disk or of another process, by SQLite's number."""


def connect(path: Path, schema: str, version: int | None = None) -> sqlite3.Connection:
    """Return a connection to an index, whose transactions begin and end as they are told.

    Args:
        path: of the index.
        schema: its statements, with `;` between.
        version: what it holds; None for any.

    Raises:
        sqlite3.DatabaseError: it is broken, or has other tables or another version.
    """
    if path.is_symlink() or not path.is_file():  # a pipe would be waited for, and a new file made
        raise sqlite3.DatabaseError("it is no file")
    db = sqlite3.connect(path, timeout=BUSY_S, isolation_level=None, check_same_thread=False)
    try:
        db.executescript("pragma trusted_schema = off; pragma cell_size_check = on;")
        tables = _tables(db)
        found = db.execute("pragma user_version").fetchone()[0]
    except BaseException:
        db.close()
        raise
    if tables != _statements(schema) or version not in (None, found):
        db.close()
        raise sqlite3.DatabaseError("it has other tables" if tables != _statements(schema) else "it has other contents")
    return db


def create(path: Path, schema: str, version: int, *, journal: str = "delete") -> None:
    """Make an empty index for its user alone, unless another process is quicker.

    Raises:
        OSError: the disk is full, or takes nothing.
    """
    os.close(os.open(path, os.O_CREAT | os.O_RDWR | NO_FOLLOW, 0o600))
    with contextlib.closing(sqlite3.connect(path, timeout=BUSY_S)) as db, faults(path):
        statements = f"{schema}; pragma user_version = {version}; commit; pragma journal_mode = {journal};"
        try:
            db.executescript(f"begin immediate; {statements}")
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode != sqlite3.SQLITE_ERROR:  # what another process makes is there already
                raise


def remove(path: Path) -> None:
    """Take away what is at the place of an index, and what SQLite keeps beside it.

    A directory that holds anything is not ours to delete: it is put aside under a longer name.
    """
    for name in (path, *(path.with_name(f"{path.name}{end}") for end in _BESIDE)):
        if name.is_dir() and not name.is_symlink():
            try:
                name.rmdir()
            except OSError:
                name.rename(tempfile.mkdtemp(prefix=f"{name.name}.", dir=name.parent))
        else:
            name.unlink(missing_ok=True)


@contextlib.contextmanager
def faults(path: Path) -> Iterator[None]:
    """Raise a fault of the machine as an `OSError` of this file; a broken index stays a `sqlite3.DatabaseError`."""
    try:
        yield
    except sqlite3.Error as error:
        if (number := _MACHINE.get(getattr(error, "sqlite_errorcode", 0) & 0xFF)) is not None:
            raise OSError(number, os.strerror(number), str(path)) from error
        raise


def _statements(schema: str) -> list[str]:
    return [statement.strip() for statement in schema.split(";") if statement.strip()]


def _tables(db: sqlite3.Connection) -> list[str]:
    found = db.execute("select sql from sqlite_master where sql is not null order by rowid")
    return [re.sub("^CREATE (TABLE|INDEX)", lambda match: match[0].lower(), sql).strip() for (sql,) in found]
