"""The whole map, for those who watch."""

from __future__ import annotations

from enum import IntFlag
from typing import Literal, NamedTuple

from pydantic import Field

from khala_protocol.messages.base import Count, Frozen, Point, Wire


class GridView(Frozen):
    """A grid of cells over the whole map, seen from above."""

    width: int = Field(ge=0)
    """Cells from west to east."""
    height: int = Field(ge=0)
    """Cells from north to south."""
    data: str
    """A byte for each cell, row after row from the north-west, deflated (zlib), in base64."""


class ResourceMark(NamedTuple):
    """A mineral field, a geyser, a rock or a tower of the map, that belongs to nobody; a list in JSON."""

    tag: int
    """As the game names it to who sees it; it may have another one in somebody's memory."""
    type: str
    """Name of its type, `MineralField`."""
    x: float
    """In the minimap frame."""
    y: float
    """In the minimap frame."""
    radius: float
    """In cells of the minimap frame."""


class Terrain(Wire):
    """Host → all but agents: the ground of an episode, once at its beginning."""

    kind: Literal["terrain"] = "terrain"
    episode: Count
    size: tuple[int, int]
    """Width and height of the map, in world units."""
    bounds: tuple[float, float, float, float]
    """The playable part of the minimap frame: x0, y0, x1, y1."""
    minimap: float = 64.0
    """Size of the minimap frame, which holds the longer side of the map."""
    height: GridView
    """Height of the ground, 0 to 255 for -16 to 16 world units."""
    walkable: GridView
    """1 where ground units can walk."""
    resources: tuple[ResourceMark, ...] = ()
    starts: tuple[Point, ...] = ()
    """Places where a player may begin, as far as the game says."""


class UnitFlag(IntFlag):
    """Properties of a unit of a scene."""

    STRUCTURE = 1
    WORKER = 2
    ARMY = 4
    FLYING = 8
    BURROWED = 16
    CLOAKED = 32
    HALLUCINATION = 64
    UNPOWERED = 128
    REMEMBERED = 256
    """Nobody sees it now: its values are those of the last look."""
    FIRES = 512
    """It has fired since the scene before."""


class UnitMark(NamedTuple):
    """One unit of a scene, a list in JSON; positions and lengths in the minimap frame."""

    tag: int
    """The game's own number of the unit, constant for the whole episode."""
    type: str
    """Name of its type, `Stalker`."""
    player: int
    """Number of its player, from 1; 16 for nobody."""
    x: float
    """Of its middle."""
    y: float
    """Of its middle."""
    radius: float
    """0 if the game has none for it."""
    facing: float
    """Direction in radians from east, clockwise as seen on the screen."""
    health: float
    """0, as the following ones, where `health_max` is 0."""
    health_max: float
    """0 if nobody knows: of what is in the fog of all sides, the game tells places and types."""
    shield: float
    """Shield points."""
    shield_max: float
    """0 for a unit without shields."""
    energy: float
    """0 for a unit without energy."""
    progress: float
    """Of its construction, 0 to 1."""
    flags: int
    """Sum of `UnitFlag`."""
    seen_by: int
    """Bit i is set if side i of the scene's `sides` sees it now."""
    order: str
    """Name of its current order; "" if it has none, or if nobody may know."""
    target: int
    """Tag of the unit that its order or its weapon is aimed at; 0 for none."""
    to_x: float
    """Where its order leads; -1 for nowhere."""
    to_y: float
    """Where its order leads; -1 for nowhere."""


class EffectMark(NamedTuple):
    """An effect on the ground, a list in JSON: a storm, a bile, a cloud."""

    name: str
    """As PySC2 has it, `PsiStorm`."""
    player: int
    """Number of the player whose it is; 0 if unknown."""
    x: float
    """In the minimap frame."""
    y: float
    """In the minimap frame."""
    radius: float
    """In cells of the minimap frame; 0 if the game has none for it."""


class PowerMark(NamedTuple):
    """A power field, a list in JSON."""

    player: int
    """Number of the player whose it is."""
    x: float
    """In the minimap frame."""
    y: float
    """In the minimap frame."""
    radius: float
    """In cells of the minimap frame."""


class PlayerMark(Frozen):
    """One player of a scene."""

    player: int
    """Its number, from 1."""
    side: str = ""
    """The side that Khala plays; "" for an opponent."""
    race: str = ""
    units: int = 0
    """Units and structures that this scene has of it."""
    workers: int = 0
    army_value: int = 0
    """Minerals and vespene of its army."""
    minerals: int | None = None
    """None for a player whose resources Khala does not see."""
    vespene: int | None = None
    supply_used: float | None = None
    supply_cap: float | None = None
    income: tuple[float, float] | None = None
    """Minerals and vespene per minute."""
    upgrades: tuple[str, ...] = ()


class Scene(Wire):
    """Host → all but agents: the whole map at one step, before its decisions take effect. Never for agents."""

    kind: Literal["scene"] = "scene"
    episode: Count
    step: Count
    game_loop: Count
    sides: tuple[str, ...]
    """The sides that Khala plays, in the order of the bits of `UnitMark.seen_by`."""
    whole: bool
    """Whether it has all units: the game showed the map without fog, or all players are Khala's. Otherwise it is what
    the sides know together."""
    players: tuple[PlayerMark, ...]
    units: tuple[UnitMark, ...]
    """Units and structures, without the resources of the map."""
    effects: tuple[EffectMark, ...] = ()
    power: tuple[PowerMark, ...] = ()
    """Power fields of the sides."""
    gone: tuple[int, ...] = ()
    """Tags of the terrain's resources that are no longer there, as far as anybody knows."""
    creep: GridView | None = None
    """1 where creep is; None if there is none."""
    fog: dict[str, GridView] = {}
    """By side: 2 where it sees now, 1 where it once saw, 0 elsewhere."""
