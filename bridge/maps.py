"""The maps that can be played: a typed reading of `bridge/data/maps.yaml`.

Where a map is and who plays on it; what stands on it is known by the game alone.
"""

from __future__ import annotations

import functools
from typing import Literal, TypeAlias

from bridge import data
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
