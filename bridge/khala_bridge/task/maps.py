"""The maps that can be played: a typed reading of `bridge/khala_bridge/data/maps.yaml`.

The file of a map, its players and its purpose; only the game knows the rest.
"""

from __future__ import annotations

import functools
from pathlib import PurePosixPath
from typing import Literal, TypeAlias

from pydantic import Field, field_validator

from khala_bridge import data
from khala_bridge.knowledge import DataSet  # noqa: TC001  # pydantic evaluates it
from khala_protocol.messages import Frozen

Race: TypeAlias = Literal["protoss", "terran", "zerg", "random"]
Difficulty: TypeAlias = Literal[
    "very_easy",
    "easy",
    "medium",
    "medium_hard",
    "hard",
    "harder",
    "very_hard",
    "cheat_vision",
    "cheat_money",
    "cheat_insane",
]


PAPERS = "_paper"
"""Ends the name of a map that plays what the paper says."""
MOST_LOOPS = 2**24
"""Game loops of a game: more than eight days; a game of the real one ends before 2**19 by itself."""


class PapersMap(Frozen):
    """Another map beside a published one, which plays what the paper says. Only the simulator has it."""

    limit_loops: int | None = Field(default=None, ge=1, le=MOST_LOOPS)
    """Game loop at which it ends the game; None for that of the published map."""


class MapSpec(Frozen):
    """One map and its players."""

    name: str = ""
    file: str
    """Below the directory `Maps` of the install; a directory of yours can be linked there."""
    race: Race
    """Of the agents' side."""
    opponent: Race | None
    """Of the computer player, or of the second side; None if the map is played alone."""
    any_race: bool = False
    """Whether a task may choose the race of a side: the map does not place its units."""
    two_sides: bool = False
    """Whether a second side of agents, or another player, can take the place of the computer player."""
    difficulty: Difficulty = "very_hard"
    """Of the computer player; the setting of LLM-PySC2's code."""
    limit_loops: int | None = Field(default=None, ge=1, le=MOST_LOOPS)
    """Game loop at which the map itself ends the game."""
    endless: bool = False
    """Whether the map ends no battle: the episode is over when a side of its first units has none that fights."""
    data: DataSet = "multi"
    """Data of the game that the map depends on: units have other numbers in those of a campaign."""
    goal: str = ""
    """The task on the map."""
    units: tuple[str, ...] = ()
    """Types of the agents' units, for a task that is made for the map."""
    upgrades: tuple[str, ...] = ()
    """Upgrades that the map grants the agents' side, as far as actions need them; named as in `pysc2.lib.upgrades`."""
    paper: PapersMap | None = None
    """For `variant: paper` of a task; None if the published map plays what the paper says."""

    @field_validator("file")
    @classmethod
    def _below_maps(cls, file: str) -> str:
        parts = PurePosixPath(file).parts
        if not parts or ".." in parts or PurePosixPath(file).is_absolute() or not file.isprintable():
            raise ValueError("give the path of a map from the directory Maps of the install downwards")
        return file

    def as_in_paper(self) -> MapSpec:
        """Return the map that plays what the paper says: this one, unless there is another."""
        if self.paper is None:
            return self
        file = PurePosixPath(self.file)
        changed = {"name": f"{self.name}{PAPERS}", "file": str(file.with_stem(f"{file.stem}{PAPERS}"))}
        limit = self.paper.limit_loops or self.limit_loops
        return self.model_copy(update=changed | {"limit_loops": limit, "paper": None})


@functools.cache
def known_maps() -> dict[str, MapSpec]:
    """Return every map by name, in the order of the file."""
    return {name: spec.model_copy(update={"name": name}) for name, spec in data.table("maps.yaml", MapSpec).items()}
