"""A player's knowledge of the game at one moment: one frozen value per player and step.

Everything above the game is a function of snapshots. `khala_bridge.state.read` makes them; nothing else in Khala reads
the messages of the SC2 API. A snapshot is not a connection: it asks the game nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_bridge.frames import WorldPoint
    from khala_bridge.knowledge import MapFacts
    from khala_bridge.state.episode import EpisodeInfo
    from khala_bridge.state.grid import Grid
    from khala_bridge.state.pictures import GamePictures
    from khala_bridge.state.unit import Alliance, Unit
    from khala_protocol.messages import Outcome


Forfeit: TypeAlias = Literal["guest left", "guest gone", "guest hung"]
"""How a guest lost a game that was going on: it gave up, its connection or its process ended, or it did not go on."""


class PlayerState(NamedTuple):
    """The resources and counts of a player."""

    player_id: int = 0
    minerals: int = 0
    vespene: int = 0
    food_cap: int = 0
    """The cap of supply."""
    food_used: int = 0
    food_army: int = 0
    """Supply of the units except workers."""
    food_workers: int = 0
    """Supply of the workers, which is their number."""
    idle_worker_count: int = 0
    army_count: int = 0
    """Number of units that the game counts as army."""


class PlayerScore(NamedTuple):
    """The game's own score of the player."""

    total: float = 0.0
    """The score itself."""
    killed: float = 0.0
    """Minerals and vespene of everything that the player destroyed in the episode."""
    lost: float = 0.0
    """Minerals and vespene of everything that the player lost in the episode."""
    income: tuple[float, float] = (0.0, 0.0)
    """Minerals and vespene that come in per minute at present."""
    spent: tuple[float, float] = (0.0, 0.0)
    """Minerals and vespene spent in the episode."""


class PowerSource(NamedTuple):
    """A field that powers structures or speeds up warping in."""

    tag: int
    """Of its source."""
    pos: WorldPoint
    radius: float
    """In world units."""


class Effect(NamedTuple):
    """An effect on the ground: a storm, a bile, a cloud."""

    effect_id: int
    alliance: Alliance
    radius: float
    """In world units; 0 if the game has none for it."""
    places: tuple[WorldPoint, ...]
    owner: int = 0
    """Number of the player that it belongs to; 16 for neutral ones, 0 if the game does not say."""


class ActionError(NamedTuple):
    """The game's refusal of a unit's order."""

    unit_tag: int
    ability_id: int
    result: str
    """The reason by the API's name, `NotEnoughMinerals`."""


@dataclass(frozen=True, slots=True)
class Snapshot:
    """One observation, with the game's answers to queries, and the losses and refusals of earlier steps."""

    info: EpisodeInfo
    """About the map; the same object for a whole episode."""
    game_loop: int
    """Game loops since the start of the episode."""
    known: dict[int, Unit]
    """Every unit that the player knows of by its tag, the remembered ones too, in ascending order of tags."""
    units: dict[int, Unit]
    """Those of `known` that are there now: in sight, or cloaked at a known place."""
    own: tuple[Unit, ...]
    """The player's own units, in ascending order of tags."""
    player: PlayerState
    score: PlayerScore
    upgrades: tuple[str, ...]
    """Names of the upgrades that the player has, in ascending order of their numbers."""
    power_sources: tuple[PowerSource, ...]
    """In the order of the game."""
    effects: tuple[Effect, ...]
    """In the order of the game."""
    alerts: tuple[str, ...]
    """The game's warnings, by the API's names, `NuclearLaunchDetected`."""
    camera: WorldPoint
    """The middle of the game's own screen."""
    creep: Grid
    """1 where the player knows of creep: where it sees it, or saw it last."""
    visibility: Grid
    """2 where the player sees now, 1 where it once saw, 0 elsewhere."""
    pictures: GamePictures = field(repr=False, compare=False)
    """The game's own pictures, decoded on demand."""
    abilities: Mapping[int, frozenset[int]] | None = None
    """By tag of an own unit, the abilities that the game would take from it now, each as itself and in its general
    form; None if the game was not asked."""
    functions: frozenset[int] = frozenset()
    """Ids of the PySC2 functions that the current selection allows."""
    dead: frozenset[int] = frozenset()
    """Tags of the units that died since the last snapshot that agents saw."""
    errors: tuple[ActionError, ...] = ()
    """Refusals of the game since then."""
    ended: bool = False
    """True if the episode is over: by a result, or at its limit of steps."""
    outcome: Outcome | None = None
    """The player's result; None while it plays, and after an end without one."""
    forfeit: Forfeit | None = None
    """Why the opponent lost other than by being beaten; None if it was beaten, or not at all."""

    @property
    def facts(self) -> MapFacts:
        """The facts about types, abilities and upgrades that hold on the map."""
        return self.info.facts
