"""The records about unit types, abilities, upgrades and buffs; only their shapes.

Facts of one version of the game, without upgrades, in seconds of the speed "faster" and in world units; names are
PySC2's. Above: `khala_bridge.knowledge.load`, which makes the records from the data files.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, TypeAlias

from pydantic import Field

from khala_protocol.messages import Frozen

if TYPE_CHECKING:
    from collections.abc import Collection

Race: TypeAlias = Literal["protoss", "terran", "zerg", "neutral"]
Target: TypeAlias = Literal["none", "point", "unit", "point_or_unit", "point_or_none"]


class WeaponFacts(Frozen):
    """One weapon of a unit type."""

    targets: Literal["ground", "air", "any"]
    range: float
    """World units between the edges of the two units."""
    min_range: float = 0
    """Least distance at which it fires."""
    damage: float
    """Of one hit, before armor."""
    attacks: int = 1
    """Hits per shot."""
    period_s: float
    """Seconds between two shots."""
    bonus: dict[str, float] = Field(default_factory=dict)
    """Extra damage against an attribute."""
    splash: float = 0
    """Radius around a hit in which other units are hurt too; 0 for none."""
    returns: bool = False
    """Whether the next shot waits until what flew to the target is back."""

    @property
    def per_second(self) -> float:
        """Damage per second against a target without armor and without the attribute of a bonus."""
        return self.damage * self.attacks / self.period_s

    def per_second_against(self, attribute: str) -> float:
        """Return the damage per second against a target without armor and with this attribute."""
        return (self.damage + self.bonus.get(attribute, 0)) * self.attacks / self.period_s


class UnitFacts(Frozen):
    """The facts and words about one type."""

    name: str = ""
    id: int
    race: Race
    about: str = ""
    """What it is and does, in a sentence or two."""
    uses: str = ""
    """How to use it well."""
    counters: tuple[str, ...] = ()
    """Types that it beats, the clearest first."""
    countered_by: tuple[str, ...] = ()
    """Types that beat it; the other direction of `counters`."""
    abilities: dict[str, str] = Field(default_factory=dict)
    """What it can do apart from moving, attacking and producing: a title and a sentence each."""
    ability_ids: tuple[int, ...] = ()
    """Every specific ability that it can be ordered to use, also to move, attack and produce."""
    melee: bool = False
    """Whether it occurs in melee games of the version; other types are leftovers in the game's data."""
    structure: bool = False
    worker: bool = False
    attributes: tuple[str, ...] = ()
    flying: bool = False
    planes: tuple[str, ...] = ()
    """Where weapons hit it: `ground`, `air`, both (Colossus), or nowhere."""
    cloaked: bool = False
    burrowed: bool = False
    health: float = 0
    shield: float = 0
    energy: float = 0
    """The most that it can have."""
    energy_start: float = 0
    armor: float = 0
    speed: float = 0
    """World units per second."""
    creep: float = 1
    """Times its speed, on creep."""
    sight: float = 0
    detects: float = 0
    """Radius in which it sees cloaked and burrowed units; 0 for none."""
    radius: float = 0
    supply: float = 0
    provides: float = 0
    """Supply that it adds to the cap."""
    minerals: float = 0
    vespene: float = 0
    """As the API counts: with the cost of the type that it was morphed from. Its ability has the cost of an order."""
    cargo_size: int = 0
    """Places that it takes in a transport; 0 if it can't be carried."""
    cargo_space: int = 0
    resource: str = ""
    """The resource that workers gather from it: `minerals` or `vespene`."""
    producers: tuple[str, ...] = ()
    """Types that make it or become it."""
    made_by: tuple[int, ...] = ()
    """Ids of the abilities with which they do so."""
    build_s: float = 0
    """Seconds until it is finished, by the first of these ways."""
    requires: tuple[str, ...] = ()
    """Structures that must stand; all of them. `stand_ins` returns what may stand in for one."""
    addon: str = ""
    """Add-on that the producer must have: `TechLab`."""
    allows: tuple[str, ...] = ()
    """Types and upgrades that require it."""
    footprint: tuple[int, int] | None = None
    """Width and height of the cells that it blocks."""
    power_radius: float = 0
    needs_power: bool = False
    needs_creep: bool = False
    makes_creep: bool = False
    counts_as: tuple[str, ...] = ()
    """Types that it stands in for as a requirement: a Hive for a Lair."""
    weapons: tuple[WeaponFacts, ...] = ()

    @property
    def value(self) -> float:
        """Minerals and vespene that it costs."""
        return self.minerals + self.vespene

    def hits(self, planes: Collection[str]) -> bool:
        """Return True if any of its weapons can hit a unit on one of these planes, `ground` and `air`."""
        return any(weapon.targets == "any" or weapon.targets in planes for weapon in self.weapons)


class AbilityFacts(Frozen):
    """The facts and words about one ability.

    A general one (`Effect_Stim`) stands for the special ones in `special`; it has the users of all of them, and the
    facts that all of them share. `ability_of` returns the ability with the costs for one type of unit.
    """

    id: int
    name: str
    """As in PySC2's functions, without the ending for its arguments: `Effect_Blink_Stalker`."""
    about: str = ""
    """What it does, in a sentence with its numbers; empty if no player of a melee game uses it."""
    does: str = ""
    """Its kind: `train`, `build`, `research`, `morph`, `cancel`, `blink`, …; `general` for a general one, empty if it
    does nothing in this version."""
    general: int | None = None
    """The general ability of which it is a case."""
    special: tuple[int, ...] = ()
    melee: bool = False
    """Whether a player can use it in a melee game of the version."""
    users: tuple[str, ...] = ()
    """Types that can be ordered to use it; () for every type."""
    target: Target = "none"
    range: float | None = 0
    """World units from edge to edge; None if the whole map is in reach, 0 if it has no target or works at touch."""
    energy: float = 0
    life: float = 0
    minerals: float = 0
    vespene: float = 0
    """The price of the order, without the price of the unit that it is made of."""
    supply: float = 0
    """Supply that a use adds; for a morph, only the difference."""
    cooldown_s: float = 0
    charges: int = 0
    requires: tuple[str, ...] = ()
    """Structures and upgrades, all of them. `stand_ins` returns what may stand in for a structure."""
    addon: str = ""
    """Add-on that the unit itself must have: `TechLab`."""
    produces: str | None = None
    """The unit type that it makes or that the unit becomes."""
    count: int = 1
    """Number of these units."""
    researches: str | None = None
    time_s: float = 0
    """Seconds until its product or its research is finished."""
    autocast: Literal["on", "off"] | None = None
    """Its first setting; None for what units never do by themselves."""
    instant: bool = False
    """Whether it happens at once and leaves the orders of its user as they are; all others are orders themselves."""
    must: tuple[str, ...] = ()
    """What a target must be, all of it: `visible`, `structure`, `biological`, …"""
    must_not: tuple[str, ...] = ()
    """What a target must not be: `self`, `enemy`, `massive`, `structure`, …"""
    figures: dict[str, float] = Field(default_factory=dict)
    """Numbers of its effect: `damage`, `radius`, `duration_s`, …"""


class UpgradeFacts(Frozen):
    """The facts and words about one upgrade."""

    name: str = ""
    id: int
    about: str = ""
    race: Race | None = None
    melee: bool = False
    """Whether a player can research it in a melee game of the version."""
    minerals: float = 0
    vespene: float = 0
    time_s: float = 0
    at: tuple[str, ...] = ()
    """Structures that research it."""
    ability: int = 0
    requires: tuple[str, ...] = ()
    affects: tuple[str, ...] = ()
    """Unit types that it improves."""
    enables: tuple[int, ...] = ()
    """Ids of the abilities that need it."""
    changes: dict[str, dict[str, float]] = Field(default_factory=dict)
    """By unit type, what it adds: `speed`, `armor`, `health`, `range`, `damage`, `damage_against_light`, …;
    `attack_speed` is a share of what it was."""


class BuffFacts(Frozen):
    """The facts about one buff: an effect on a unit for a time, and what it changes there."""

    name: str = ""
    """As in observations; as in the game's data if they do not show it."""
    id: int = 0
    """0 for one that the game does not show to clients."""
    duration_s: float = 0
    """0 for one without an end of its own."""
    speed: float = 1
    attack_rate: float = 1
    work_rate: float = 1
    """Factors of its bearer's values; the last one is for training, research and the like."""
    stops_work: bool = False
    armor: float = 0
    damage_taken: float = 0
    """Damage added to each hit on its bearer, of the kinds that it is about."""
    absorbs: float = 0
    """Damage that it absorbs in all."""
    flags: tuple[str, ...] = ()
    """State of its bearer meanwhile: `stunned`, `disarmed`, `rooted`, `invulnerable`, `cloak`, …"""
