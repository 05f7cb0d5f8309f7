"""Maps as PySC2 has to be told of them: a typed reading of `bridge/data/maps.yaml`.

PySC2 knows the maps that it shipped with; these are handed to `SC2Env` as map objects, so nothing is registered
under a global name and no other package's maps can clash with them. What stands on a map is not said here.
"""

from __future__ import annotations

import functools
from pathlib import PurePosixPath
from typing import Literal, TypeAlias

from bridge import data
from bridge.compat import maps
from protocol.messages import Frozen

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


class MapSpec(Frozen):
    """One map and who plays on it."""

    name: str = ""
    file: str
    """Below the directory `Maps` of the install."""
    race: Race
    """Of the agents' side."""
    opponent: Race
    difficulty: Difficulty = "very_hard"
    """Of the computer player; the paper's setting."""
    limit_loops: int | None = None
    """Game loop at which the map itself ends the game."""


@functools.cache
def known_maps() -> dict[str, MapSpec]:
    """Every map by name, in the order of the file."""
    return {name: spec.model_copy(update={"name": name}) for name, spec in data.table("maps.yaml", MapSpec).items()}


class _Map(maps.Map):  # type: ignore[misc]  # PySC2 is untyped
    """A map of ours; it has no file name on the class, so that PySC2's global table leaves it out."""

    players = 2
    game_steps_per_episode = 0

    def __init__(self, spec: MapSpec) -> None:
        file = PurePosixPath(spec.file)
        self._name = spec.name
        self.directory = str(file.parent)
        self.filename = file.name

    @property
    def name(self) -> str:
        return self._name


def pysc2_map(spec: MapSpec) -> maps.Map:
    """The map as PySC2 takes it."""
    return _Map(spec)
