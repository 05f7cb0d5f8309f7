"""A player's side of the world: resources, research, result and score counters.

Plain counters, changed by the systems and read by the API; nothing here computes.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from khala_simulator.world.opponent_memory import OpponentMemory

NEUTRAL = 0


class GameResult(IntEnum):
    """The API's result numbers."""

    VICTORY = 1
    DEFEAT = 2
    TIE = 3
    UNDECIDED = 4


@dataclass(slots=True)
class Vitals:
    """Amounts of life, shields and energy."""

    life: float = 0.0
    shields: float = 0.0
    energy: float = 0.0


@dataclass(slots=True)
class SpentResources:
    """Minerals and vespene by the score's categories: army, economy, technology."""

    army: list[float] = field(default_factory=lambda: [0.0, 0.0])
    economy: list[float] = field(default_factory=lambda: [0.0, 0.0])
    technology: list[float] = field(default_factory=lambda: [0.0, 0.0])


@dataclass(slots=True)
class ScoreCounters:
    """Counters behind the API's score details. Values are in resources, as ``score_make`` and ``score_kill`` say."""

    killed_value_units: float = 0.0
    killed_value_structures: float = 0.0
    killed_units: int = 0
    killed_structures: int = 0
    lost_units: int = 0
    lost_structures: int = 0
    killed: SpentResources = field(default_factory=SpentResources)
    lost: SpentResources = field(default_factory=SpentResources)
    damage_dealt: Vitals = field(default_factory=Vitals)
    damage_taken: Vitals = field(default_factory=Vitals)
    healed: Vitals = field(default_factory=Vitals)
    deliveries: list[tuple[int, float, float]] = field(default_factory=list)  # loop, minerals, vespene: the last ones
    idle_worker_s: float = 0.0  # normal seconds, summed over workers
    idle_production_s: float = 0.0
    spent: list[float] = field(default_factory=lambda: [0.0, 0.0])  # minerals and vespene that were charged
    curriculum: float = 0.0  # points from the map's script
    collected: list[float] = field(default_factory=lambda: [0.0, 0.0])  # delivered minerals and vespene


@dataclass(slots=True)
class PlayerSetup:
    """The player of a slot: ``control`` is agent or computer, ``difficulty`` and ``build`` the API's numbers or 0."""

    id: int
    race: str
    control: str
    name: str = ""
    difficulty: int = 0
    build: int = 0


@dataclass(slots=True)
class WorldPlayer:
    """One player during a game; player 0 is the neutral one (the API says 16)."""

    id: int
    race: str
    control: str
    name: str = ""
    difficulty: int = 0
    build: int = 0
    minerals: float = 0.0
    vespene: float = 0.0
    upgrades: list[int] = field(default_factory=list)
    underway: list[str] = field(default_factory=list)  # names of units and upgrades that are being made
    timers: dict[str, float] = field(default_factory=dict)  # cooldown's name -> loop at which it is over
    cheats: list[str] = field(default_factory=list)  # debug states that are on
    result: GameResult = GameResult.UNDECIDED
    surrendered: bool = False
    score: ScoreCounters = field(default_factory=ScoreCounters)
    mind: OpponentMemory | None = None  # of a computer player that leads a side
    start: tuple[float, float] | None = None  # where the town hall was put at the start of a melee game
    camera: tuple[float, float] | None = None  # where the camera starts, if not where the map says

    def counters(self) -> tuple[object, ...]:
        """Return everything as nested tuples, in a fixed order, for the digest of the world."""
        return dataclasses.astuple(self)
