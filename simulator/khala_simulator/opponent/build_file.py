"""What computer players build, and when: ``data/opponents/<race>.yaml`` as frozen values.

A build is an opening, followed in order, and stages by time that say what is wanted from then on. ``spending`` spends
the money on it.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final, NamedTuple

from pydantic import BaseModel, ConfigDict

from khala_simulator.tables.loader import read_data

NAMES: Final = {2: "macro", 3: "power", 4: "rush", 5: "timing", 6: "air"}
"""The API's values of AIBuild; all others leave the choice to the seed."""


class Data(BaseModel):
    """A part of a build file: immutable, with no unknown fields."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class OpeningStep(NamedTuple):
    """One step of an opening: with so much supply in use, make this."""

    supply: float
    what: str


class BuildStage(Data):
    """The wishes of a build from a time on; those of earlier stages stay, except the army and the workers.

    ``army`` has shares, ``units`` numbers of single units, ``gas`` is the number of gas structures. ``workers`` is a
    limit below that of the level, 0 for none.
    """

    from_s: float
    bases: int
    gas: int
    army: dict[str, float]
    structures: dict[str, int] = {}
    units: dict[str, int] = {}
    research: tuple[str, ...] = ()
    workers: int = 0


class Attack(Data):
    """From when on, and with how much army supply, the first attack begins."""

    from_s: float
    supply: float


class ArmyGuard(NamedTuple):
    """Below how much army supply the army comes first: m minutes after ``from_s`` it is growth * m * (m + 1)."""

    from_s: float
    growth: float

    def supply(self, at_s: float) -> float:
        """Return that army supply at a time of the build's clock."""
        minutes = max(0.0, at_s - self.from_s) / 60.0
        return self.growth * minutes * (minutes + 1.0)


class BuildOrder(Data):
    """One way to play a race.

    With ``saves``, a step of the opening whose time has come is paid before more workers are.
    """

    opening: tuple[OpeningStep, ...]
    attack: Attack
    guard: ArmyGuard
    saves: bool = False
    stages: tuple[BuildStage, ...]


class Race(Data):
    """The builds of a race, and the names of the types with a role of their own."""

    race: str
    worker: str
    hall: str
    supply: str
    gas: str
    producer: str
    detector: str
    transport: str
    builds: dict[str, BuildOrder]


@lru_cache(maxsize=3)
def load_race(race: str) -> Race:
    """Return the builds of a race."""
    return Race.model_validate(read_data("opponents", f"{race}.yaml"))


def name_of(ai_build: int, draw: float) -> str:
    """Return the build that the API's number asks for, or the one that a ``draw`` in [0, 1) chooses."""
    names = list(NAMES.values())
    return NAMES.get(ai_build, names[int(draw * len(names))])


def stage_at(race: str, build: str, at_s: float) -> BuildStage:
    """Return what a build wants at a time of its own clock."""
    stages = load_race(race).builds[build].stages
    return _join_stages(race, build, sum(stage.from_s <= at_s for stage in stages))


@lru_cache(maxsize=128)
def _join_stages(race: str, build: str, count: int) -> BuildStage:
    """Return what the first stages of a build want together."""
    reached = load_race(race).builds[build].stages[:count]
    structures: dict[str, int] = {}
    research: dict[str, None] = {}
    for stage in reached:
        structures |= stage.structures
        research |= dict.fromkeys(stage.research)
    return reached[-1].model_copy(update={"structures": structures, "research": tuple(research)})
