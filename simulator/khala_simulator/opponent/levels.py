"""How strong a computer player is, by the API's difficulty: one row of ``data/opponents/levels.yaml`` each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

from khala_simulator.tables.loader import read_data

FASTER_LOOPS: Final = 22.4
"""Game loops in a second of game time."""
DEFAULT: Final = 3
"""The difficulty of a computer player for which none is given: medium."""


@dataclass(frozen=True, slots=True)
class OpponentLevel:
    """What distinguishes a difficulty; the data file says what each column means."""

    name: str
    think_loops: int
    actions: float
    reaction_s: float
    tempo: float
    worker_s: float
    army_s: float
    step_s: float
    workers: int
    bases: int
    production: float
    upgrades: int
    wave: float
    retreat: float
    pull: float
    skills: frozenset[str]
    vision: bool = False
    income: float = 1.0


def level_of(difficulty: int) -> OpponentLevel:
    """Return the level for a difficulty of the API; 0 and unknown ones are the default."""
    levels = load_levels()
    return levels.get(difficulty, levels[DEFAULT])


@lru_cache(maxsize=1)
def load_levels() -> dict[int, OpponentLevel]:
    """Return every level by its difficulty."""
    rows: dict[int, dict[str, Any]] = read_data("opponents", "levels.yaml")["levels"]
    return {number: _level(row, rows) for number, row in rows.items()}


def _level(row: dict[str, Any], rows: dict[int, dict[str, Any]]) -> OpponentLevel:
    whole = {**rows.get(row.get("extends", 0), {}), **row}
    whole.pop("extends", None)
    return OpponentLevel(**{**whole, "skills": frozenset(whole["skills"])})
