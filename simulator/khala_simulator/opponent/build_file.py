"""What computer players build, and when: ``data/opponents/<race>.yaml`` as frozen values.

A plan says what a level does at which time, stages what the army is made of and what is wanted late, by build.
``spending`` spends the money on it.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final, NamedTuple

from pydantic import BaseModel, ConfigDict

from khala_simulator.opponent.levels import Line
from khala_simulator.tables.loader import read_data

NAMES: Final = {2: "macro", 3: "power", 4: "rush", 5: "timing", 6: "air"}
"""The API's values of AIBuild; all others leave the choice to the seed."""


class Data(BaseModel):
    """A part of a build file: immutable, with no unknown fields."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class TimedStep(NamedTuple):
    """One step of a plan: from this time on, one more of this is wanted."""

    at_s: float
    what: str


class BuildStage(Data):
    """The wishes of a build from a time on; those of earlier stages stay, except the army.

    ``army`` has shares, ``units`` numbers of single units.
    """

    from_s: float
    army: dict[str, float]
    structures: dict[str, int] = {}
    units: dict[str, int] = {}
    research: tuple[str, ...] = ()


class GamePlan(Data):
    """What some levels do in some builds, by seconds of game time; without builds it is for all.

    ``opening`` and ``later`` are steps, ``attacks`` the times of the first attacks. ``army`` is a line of times and
    supply for an army larger than the level's, ``workers`` one of the most workers. Until ``hold_s`` there are as many
    workers as the level holds.
    """

    levels: tuple[int, ...]
    builds: tuple[str, ...] = ()
    opening: tuple[TimedStep, ...]
    later: tuple[TimedStep, ...] = ()
    attacks: tuple[float, ...] = ()
    army: Line = ()
    workers: Line = ()
    hold_s: float = 0.0

    @property
    def steps(self) -> tuple[TimedStep, ...]:
        """All steps in order."""
        return *self.opening, *self.later


class Race(Data):
    """How a race is played, and the names of the types with a role of their own.

    Of ``plans`` the first counts that is for the level and the build; ``stages`` are for every build.
    """

    race: str
    worker: str
    hall: str
    supply: str
    gas: str
    producer: str
    detector: str
    transport: str
    plans: tuple[GamePlan, ...]
    stages: tuple[BuildStage, ...]
    builds: dict[str, tuple[BuildStage, ...]]


@lru_cache(maxsize=3)
def load_race(race: str) -> Race:
    """Return the builds of a race."""
    return Race.model_validate(read_data("opponents", f"{race}.yaml"))


def name_of(ai_build: int, draw: float) -> str:
    """Return the build that the API's number asks for, or the one that a ``draw`` in [0, 1) chooses."""
    names = list(NAMES.values())
    return NAMES.get(ai_build, names[int(draw * len(names))])


def plan_of(race: str, level: int, build: str) -> GamePlan:
    """Return the plan of a level, by the API's number, for a build."""
    plans = load_race(race).plans
    return next(p for p in plans if level in p.levels and build in (p.builds or (build,)))


def stage_at(race: str, build: str, at_s: float) -> BuildStage:
    """Return what a build wants at a time of its own clock."""
    return _join_stages(race, build, sum(stage.from_s <= at_s for stage in _stages(race, build)))


def _stages(race: str, build: str) -> list[BuildStage]:
    facts = load_race(race)
    return sorted((*facts.stages, *facts.builds[build]), key=lambda stage: stage.from_s)


@lru_cache(maxsize=128)
def _join_stages(race: str, build: str, count: int) -> BuildStage:
    """Return what the first stages of a build want together."""
    reached = _stages(race, build)[:count]
    structures: dict[str, int] = {}
    units: dict[str, int] = {}
    research: dict[str, None] = {}
    for stage in reached:
        structures |= stage.structures
        units |= stage.units
        research |= dict.fromkeys(stage.research)
    wishes = {"structures": structures, "units": units, "research": tuple(research)}
    return reached[-1].model_copy(update=wishes)
