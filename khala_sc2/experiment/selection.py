"""Some matches of an experiment: `llm_pysc2`, or those of a factor's value, `llm_pysc2:player=skilled`.

Only matches that were played to their end and are valid are selected.
"""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from khala_protocol.errors import ConfigError
from khala_sc2.experiment.plan import FACTOR
from khala_sc2.experiment.store import Store

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_sc2.experiment.played import PlayedMatch

SIDE = "side"
"""A name that selections know beside the factors, for duels."""

Row = dict[str, Any]
"""An episode and side, as `Store.results` has it."""


@dataclass(frozen=True)
class Selection:
    """Matches, and their rows."""

    text: str
    """As it was given."""
    where: dict[str, str]
    factors: tuple[str, ...]
    """Of the experiment, in its order."""
    matches: dict[str, PlayedMatch]
    """By key."""
    rows: list[Row]
    left_out: dict[str, int]
    """How many matches are not among them, by state."""

    @property
    def sides(self) -> list[str]:
        """The sides that the rows are about."""
        return list(dict.fromkeys(row[SIDE] for row in self.rows))


def select(text: str, out: Path) -> Selection:
    """Return the matches that a text names.

    Args:
        text: `DIR`, or `DIR:factor=value,factor=value`.
        out: where `DIR` is looked for if there is no such directory.

    Raises:
        ConfigError: there is no such experiment, factor or value, or no match of it can be used.
    """
    directory, conditions = _split(text)
    store = Store.open(Path(directory), out)
    played = store.matches()
    factors = factors_of(played.values())
    where = _where(conditions, factors, text)
    chosen = {key: match for key, match in played.items() if _fits(match.cell, where)}
    _check_values(where, played.values(), text)
    matches = {key: match for key, match in chosen.items() if match.state == "done"}
    rows = [row for row in store.results() if row["match"] in matches and row[SIDE] == where.get(SIDE, row[SIDE])]
    if not rows:
        raise ConfigError(f"{text} has no match that was played to its end and is valid: see `khala experiment status`")
    return Selection(text, where, factors, matches, rows, states_of(chosen.values()))


def factors_of(matches: Iterable[PlayedMatch]) -> tuple[str, ...]:
    """Return the names of factors of any match, in their order."""
    return tuple(dict.fromkeys(name for match in matches for name in match.cell))


def states_of(matches: Iterable[PlayedMatch]) -> dict[str, int]:
    """Return how many matches are not done, by state."""
    states = [match.state for match in matches]
    return {state: states.count(state) for state in ("invalid", "crashed") if state in states}


def factor(row: Row, name: str) -> str:
    """Return the name of a factor's value in a row, or its side; "" if it has none."""
    return str(row.get(SIDE if name == SIDE else f"{FACTOR}{name}") or "")


def _split(text: str) -> tuple[str, str]:
    """Return the directory and the conditions; a directory may hold a colon."""
    head, colon, tail = text.rpartition(":")
    return (head, tail) if colon and "=" in tail and not Path(text).is_dir() else (text, "")


def _where(conditions: str, factors: tuple[str, ...], text: str) -> dict[str, str]:
    """Return the values by factor; a comma within a value is none if no factor follows it."""
    if not conditions:
        return {}
    names = "|".join(map(re.escape, (*factors, SIDE)))
    parts = re.split(rf",(?=(?:{names})=)", conditions)
    where = dict(part.partition("=")[::2] for part in parts)
    for name in where:
        if name not in (*factors, SIDE):
            raise ConfigError(
                f"{text}: there is no factor {name!r}{_hint(name, factors)}; there are {', '.join(factors)}"
            )
    return where


def _check_values(where: dict[str, str], matches: Iterable[PlayedMatch], text: str) -> None:
    matches = list(matches)
    for name, value in where.items():
        known = list(dict.fromkeys(match.cell.get(name, "") for match in matches))
        if name != SIDE and value not in known:
            raise ConfigError(
                f"{text}: no match has {name} {value!r}{_hint(value, known)}; there are {', '.join(known)}"
            )


def _fits(cell: dict[str, str], where: dict[str, str]) -> bool:
    return all(name == SIDE or cell.get(name) == value for name, value in where.items())


def _hint(word: str, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(word, list(known), n=1)
    return f", did you mean {close[0]}?" if close else ""
