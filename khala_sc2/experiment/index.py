"""The rows of an experiment's index: its tables, how a match is noted in them, and how they are read.

`khala_sc2.experiment.store` above owns the file; `khala_sc2.indexes` below makes it again when it is broken. Whatever
stands in a row is checked when it is read, as the file may be anyone's.
"""

from __future__ import annotations

import json
import logging
from dataclasses import astuple
from functools import cache
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter

from khala_protocol.transaction import transaction
from khala_sc2 import indexes
from khala_sc2.experiment.measures import CallCount, Measures
from khala_sc2.experiment.plan import FACTOR
from khala_sc2.experiment.played import PlayedMatch

if TYPE_CHECKING:
    import sqlite3
    from collections.abc import Sequence
    from pathlib import Path

log = logging.getLogger(__name__)

Row = tuple[Measures, list[CallCount]]
VERSION = 1
SCHEMA = """
create table matches (
    key text primary key, cell text not null, seed integer not null, repetition integer not null,
    state text not null, cause text not null, attempts integer not null, recording text not null,
    wall_s real, cost_usd real, tokens integer, card text not null
);
create table calls (
    match text not null, episode integer not null, side text not null,
    agent text not null, action text not null, became text not null, count integer not null
);
create index calls_of_match on calls(match);
"""
_TYPES = {"str": "text", "int": "integer", "float": "real", "bool": "integer"}
_READ = {"str": (str,), "int": (int,), "float": (int, float, type(None)), "bool": (int,)}
"""What SQLite has for each type of a measure; nothing for a number that is none."""


def result_columns() -> dict[str, str]:
    """Return the columns of `results` after the first one, with their types."""
    kinds = {name: str(kind).split(" | ")[0] for name, kind in _annotations().items()}
    return {name: _TYPES[kind] for name, kind in kinds.items()}


def _annotations() -> dict[str, Any]:
    return {name: field.type for name, field in Measures.__dataclass_fields__.items()}


def _places(values: list[Any]) -> str:
    return f"({', '.join('?' * len(values))})"


CALLS = ("match", "episode", "side", "agent", "action", "became", "count")


def schema() -> str:
    """Return the statements that make the tables."""
    columns = ", ".join(f'"{name}" {kind}' for name, kind in result_columns().items())
    return f"{SCHEMA} create table results (match text not null, {columns}); create index of_match on results(match)"


def create(path: Path) -> sqlite3.Connection:
    """Create an empty index, and open it."""
    indexes.create(path, schema(), VERSION)
    return connect(path)


def connect(path: Path) -> sqlite3.Connection:
    """Open an index; raise `sqlite3.DatabaseError` if it is none of this version."""
    return indexes.connect(path, schema(), VERSION)


def take(index: sqlite3.Connection, path: Path, played: PlayedMatch, rows: Sequence[Row]) -> None:
    """Note what a recording says, which may be anyone's."""
    try:
        add(index, played, rows)
    except OverflowError:
        log.warning("%s has a number that is larger than SQLite's: it is left out", path)


def add(index: sqlite3.Connection, played: PlayedMatch, rows: Sequence[Row]) -> None:
    """Note what became of a match; it replaces what was known of it."""
    values = [getattr(played, name) for name in PlayedMatch.__slots__]
    plain = [json.dumps(value) if isinstance(value, dict) else value for value in values]
    names = list(result_columns())
    with transaction(index):
        for table in ("results", "calls"):
            index.execute(f"delete from {table} where match = ?", (played.key,))  # noqa: S608
        index.execute(f"insert or replace into matches values {_places(plain)}", plain)  # noqa: S608  # question marks
        for row, calls in rows:
            place = played.key, row.episode, row.side
            counts = [(*place, *astuple(call)) for call in calls]
            index.executemany("insert into calls values (?, ?, ?, ?, ?, ?, ?)", counts)
            values = [played.key, *(getattr(row, name) for name in names)]
            index.execute(f"insert into results values {_places(values)}", values)  # noqa: S608


def played_in(index: sqlite3.Connection) -> dict[str, PlayedMatch]:
    """Return the matches; raise `ValueError` if one is not as we write it."""
    names = PlayedMatch.__slots__
    columns = ", ".join(PlayedMatch.__slots__)
    found = index.execute(f"select {columns} from matches order by rowid")  # noqa: S608  # our own names
    rows = (dict(zip(names, row, strict=True)) for row in found)
    plain = (row | {name: json.loads(row[name]) for name in ("cell", "card")} for row in rows)
    return {played.key: played for played in map(_match().validate_python, plain)}


@cache
def _match() -> TypeAdapter[PlayedMatch]:
    return TypeAdapter(PlayedMatch)


def results_in(index: sqlite3.Connection) -> list[dict[str, Any]]:
    """Return the rows; raise `ValueError` or `LookupError` if one is not as we write it."""
    kinds = _annotations()
    columns = ", ".join(f'"{name}"' for name in kinds)
    # Results first: of a match that ends meanwhile, the match is known then, and its results are not.
    found = index.execute(f"select match, {columns} from results order by rowid").fetchall()  # noqa: S608  # our own names
    matches = played_in(index)
    return [_join(matches[key], _check_types(dict(zip(kinds, row, strict=True)), kinds)) for key, *row in found]


def _check_types(row: dict[str, Any], kinds: dict[str, Any]) -> dict[str, Any]:
    """Return a row; raise `ValueError` if a value is of another type than its column: SQLite takes any."""
    for name, kind in kinds.items():
        types, _, nothing = str(kind).partition(" | ")
        if not isinstance(row[name], _READ[types]) and not (nothing and row[name] is None):
            raise ValueError(f"{name} is {row[name]!r:.40}")
    return row


def _join(match: PlayedMatch, row: dict[str, Any]) -> dict[str, Any]:
    cell = {f"{FACTOR}{name}": value for name, value in match.cell.items()}
    about = {"match": match.key, "state": match.state, "cause_of_state": match.cause, "repetition": match.repetition}
    return {**about, **cell, **row}
