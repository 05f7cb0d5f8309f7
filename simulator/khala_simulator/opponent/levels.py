"""How hard a computer player plays, by the API's difficulty. All of it is an estimate.

A level says how many workers, production structures and gas structures it wants, how many units it waits for before it
attacks, and how often it looks at what it has. A computer player has no advantages.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Level:
    """The aims of a computer player.

    ``period_loops`` is how often it thinks, ``peace_loops`` how long it stays at home.
    """

    workers: int
    producers: int
    gas: int
    wave: int
    period_loops: int
    peace_loops: int


LEVELS: Final = {
    1: Level(workers=12, producers=1, gas=0, wave=4, period_loops=224, peace_loops=8064),
    2: Level(workers=14, producers=1, gas=0, wave=5, period_loops=160, peace_loops=6720),
    3: Level(workers=16, producers=2, gas=1, wave=8, period_loops=96, peace_loops=5376),
    4: Level(workers=17, producers=2, gas=1, wave=10, period_loops=64, peace_loops=4704),
    5: Level(workers=19, producers=3, gas=1, wave=12, period_loops=48, peace_loops=4032),
    6: Level(workers=20, producers=3, gas=2, wave=14, period_loops=32, peace_loops=4032),
    7: Level(workers=22, producers=4, gas=2, wave=16, period_loops=32, peace_loops=3360),
}
HARDEST: Final = LEVELS[7]


def level_of(difficulty: int) -> Level:
    """Return the level for a difficulty, by default a medium one; the cheating ones do not cheat."""
    return LEVELS.get(difficulty or 3, HARDEST)
