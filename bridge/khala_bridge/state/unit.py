"""A unit as the game shows it to a player: numbers and names, no messages of the API.

Fields that come from the SC2 API have its names. Positions are in the world frame; times are in game loops, 22.4 of
which pass in a second. Values that the API has only for the player's own units are empty or 0 for all others.
"""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple

from khala_bridge.names import buff_name, order_name

if TYPE_CHECKING:
    from khala_bridge.frames import WorldPoint
    from khala_bridge.knowledge import UnitFacts


class Alliance(IntEnum):
    """Owner of a unit, by the numbers of the SC2 API."""

    OWN = 1
    ALLY = 2
    NEUTRAL = 3
    ENEMY = 4


class Display(IntEnum):
    """Visibility of a unit, by the numbers of the SC2 API; its placeholders are not units here."""

    VISIBLE = 1
    """It is in sight."""
    REMEMBERED = 2
    """It was seen before and is now under the fog of war; all values are of that time."""
    HIDDEN = 3
    """It is cloaked and not detected; the game sends its place all the same."""


# an attribute of an enumeration takes ten times as long as a global
_OWN, _ENEMY, _NEUTRAL, _REMEMBERED = Alliance.OWN, Alliance.ENEMY, Alliance.NEUTRAL, Display.REMEMBERED


class UnitOrder(NamedTuple):
    """One order that a unit carries out or has in its queue."""

    ability_id: int
    """The special ability, `Attack_Attack`, not the general one."""
    target_unit_tag: int = 0
    """Tag of the unit that it is aimed at; 0 for none."""
    target_world_space_pos: WorldPoint | None = None
    """The place that it is aimed at; None for none."""
    progress: float = 0.0
    """Share of the training or research that is done, from 0 to 1."""

    @property
    def name(self) -> str:
        """Name of the ability in its general form where there is one, `Attack`."""
        return order_name(self.ability_id)


class Unit(NamedTuple):
    """One unit, structure, resource or rock at one moment."""

    name: str
    """Name of its type as PySC2 has it, `Stalker`."""
    facts: UnitFacts | None
    """The facts about its type on this map; None for a type that `khala_bridge.knowledge` does not have."""
    alliance: Alliance
    display_type: Display
    pos: WorldPoint
    """Its middle."""
    is_cloaked: bool
    """True if it is cloaked, whether it is detected or not."""
    buff_ids: tuple[int, ...]
    """Numbers of its buffs."""
    # --- as in the API ---
    tag: int
    """The game's own number of the unit, constant for the whole episode."""
    unit_type: int
    """Number of its type."""
    owner: int
    """Number of the player that it belongs to; 16 for neutral ones."""
    facing: float
    """Direction that it faces, in radians from east, counterclockwise."""
    radius: float
    """In world units; 0 if the game has none for it."""
    build_progress: float
    """Share of its construction that is done; 1 for a finished unit."""
    health: float
    health_max: float
    shield: float
    shield_max: float
    energy: float
    energy_max: float
    """0 for a unit without energy."""
    is_flying: bool
    is_burrowed: bool
    is_hallucination: bool
    mineral_contents: int
    """Minerals that are left in a mineral field."""
    vespene_contents: int
    """Vespene that is left in a geyser or in the structure on it."""
    # --- only of the player's own units; those up to `buff_duration_remain` as in the API ---
    is_powered: bool = False
    """True if a power field reaches it, also for structures that need none."""
    is_selected: bool = False
    """True if the game's own selection holds it."""
    add_on_tag: int = 0
    """Tag of the TechLab or Reactor that is attached; 0 for none."""
    engaged_target_tag: int = 0
    """Tag of the unit that it fires at; 0 for none."""
    weapon_cooldown: float = 0.0
    """Game loops until it can fire again."""
    cargo_space_max: int = 0
    """Places for passengers; 0 for a unit that carries none."""
    assigned_harvesters: int = 0
    """Number of workers that gather for a town hall or at a gas structure."""
    ideal_harvesters: int = 0
    """Number of workers that it has work for."""
    buff_duration_remain: int = 0
    """Game loops until its buff ends, or the unit itself if it lives for a time only; 0 for neither."""
    passengers: tuple[str, ...] = ()
    """Types of the units in it, by name."""
    orders: tuple[UnitOrder, ...] = ()
    """The order at work first; () for an idle unit."""

    @property
    def is_own(self) -> bool:
        """True if it belongs to the player."""
        return self.alliance is _OWN

    @property
    def is_enemy(self) -> bool:
        """True if it belongs to an enemy."""
        return self.alliance is _ENEMY

    @property
    def is_neutral(self) -> bool:
        """True if it belongs to nobody: a resource, a rock."""
        return self.alliance is _NEUTRAL

    @property
    def is_remembered(self) -> bool:
        """True if it was seen before and is not in sight now."""
        return self.display_type is _REMEMBERED

    @property
    def is_structure(self) -> bool:
        """True if it is a structure; unknown types are not."""
        return self.facts is not None and self.facts.structure

    @property
    def buffs(self) -> tuple[str, ...]:
        """Names of its buffs, `GravitonBeam`."""
        return tuple(map(buff_name, self.buff_ids))

    @property
    def planes(self) -> frozenset[str]:
        """Where weapons hit it now: `ground`, `air`, or both for a Colossus; a unit lifted by a Phoenix: `air`."""
        usual = frozenset(self.facts.planes) if self.facts is not None else frozenset[str]()
        if self.is_flying or "GravitonBeam" in self.buffs:
            return (usual | {"air"}) - {"ground"}
        return usual | {"ground"}
