"""How strong a computer player is, by the API's difficulty: one row of ``data/opponents/levels.yaml`` each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import numpy as np

from khala_simulator.tables.loader import read_data

FASTER_LOOPS: Final = 22.4
"""Game loops in a second of game time."""
DEFAULT: Final = 3
"""The difficulty of a computer player for which none is given: medium."""


Line = tuple[tuple[float, float], ...]
"""Points (seconds of game time, value): straight between them, level before the first and after the last."""


@dataclass(frozen=True, slots=True)
class OpponentLevel:
    """What distinguishes a difficulty; the data file says what each column means."""

    number: int
    name: str
    think_loops: int
    actions: float
    reaction_s: float
    tempo: float
    workers: int
    hold: int
    site: int
    bases: int
    army: Line
    production: float
    upgrades: int
    retreat: float
    pull: float
    skills: frozenset[str]
    vision: bool = False
    income: float = 1.0


def along(line: Line, at_s: float) -> float:
    """Return the value of a line at a time; 0 if it has no points."""
    return float(np.interp(at_s, [at for at, _ in line], [value for _, value in line])) if line else 0.0


@lru_cache
def level_of(difficulty: int) -> OpponentLevel:
    """Return the level for a difficulty of the API; 0 and unknown ones are the default."""
    levels = load_levels()
    return levels.get(difficulty, levels[DEFAULT])


@lru_cache(maxsize=1)
def load_levels() -> dict[int, OpponentLevel]:
    """Return every level by its difficulty."""
    rows: dict[int, dict[str, Any]] = read_data("opponents", "levels.yaml")["levels"]
    return {number: _level(number, rows) for number in rows}


def _level(number: int, rows: dict[int, dict[str, Any]]) -> OpponentLevel:
    whole = _whole(rows[number], rows)
    army = tuple((at_s, supply) for at_s, supply in whole["army"])
    return OpponentLevel(number, **{**whole, "army": army, "skills": frozenset(whole["skills"])})


def _whole(row: dict[str, Any], rows: dict[int, dict[str, Any]]) -> dict[str, Any]:
    """Return a row with what it takes over from the one that it extends."""
    base = _whole(rows[row["extends"]], rows) if "extends" in row else {}
    return {**base, **{key: value for key, value in row.items() if key != "extends"}}
