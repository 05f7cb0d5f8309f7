"""What one row of the game's tables is: records of units, weapons, upgrades and footprints.

Data only, with the units of every number; ``catalog`` reads it from the shipped tables, ``stats`` applies a player's
upgrades. Times whose name ends in ``_loops`` are game loops; a name ending in ``_n`` keeps the catalog's own unit, per
"normal" second of 16 loops.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Area:
    """One ring of a splash: everything within ``radius`` of the impact takes ``fraction`` of the damage."""

    radius: float
    fraction: float
    arc_deg: float = 360.0


@dataclass(frozen=True, slots=True)
class Affects:
    """Which units a splash, a sweep or a search touches in addition to the target itself."""

    allies: bool = False
    plane: str = "any"
    only: str = ""
    excluding: str = ""
    not_self: bool = False
    not_target: bool = False
    neutral: bool = True


@dataclass(frozen=True, slots=True)
class SweepRecord:
    """A line of small circles drawn one after the other, as the Colossus' beams and the Lurker's spines do.

    Each point is ``(delay_loops, across, along)``: the offset from the ``origin`` ("target" or "source") is in the
    frame of the shot, ``across`` to its right, ``along`` backwards from the target to the attacker (the catalog's own
    axes). A unit is hit once per sweep, ``lag_loops`` after it was touched; the delays include the lag. A sweep from
    the attacker ends ``past_range`` beyond the weapon's range. One that ``follows`` goes with its target.
    """

    radius: float
    points: tuple[tuple[float, float, float], ...]
    affects: Affects
    origin: str = "target"
    lag_loops: float = 0.0
    past_range: float = 0.0
    follows: bool = False


@dataclass(frozen=True, slots=True)
class Search:
    """A second circle (or arc) in which the same damage is dealt again, around the target or in front of the attacker.

    ``origin`` is "target" or "source"; from the source the radius counts from its edge. With a ``max_count`` only the
    nearest so many are taken.
    """

    radius: float
    affects: Affects
    arc_deg: float = 360.0
    max_count: int = 0
    origin: str = "target"


@dataclass(frozen=True, slots=True)
class Hit:
    """One damage of one shot.

    ``delay_loops`` counts from the weapon's damage point. A hit with a ``missile_speed_n`` is carried by a missile
    that leaves then. ``when`` names a branch of the game's own switch (branches exclude each other). A hit with a
    ``beam_tick_n`` repeats as long as the attack goes on, once per period. A ``bounce`` leaves from the last victim. A
    missile that ``returns`` hangs on its attacker, whose cooldown begins anew with the hit.
    """

    effect: str
    damage: float
    bonus: tuple[tuple[str, float], ...] = ()
    delay_loops: float = 0.0
    ignores_armor: bool = False
    kind: str = "ranged"
    kills_self: bool = False
    when: str = ""
    missile_speed_n: float | None = None
    missile_acceleration_n: float | None = None
    missile_start_n: float = 0.0
    beam_tick_n: float | None = None
    area: tuple[Area, ...] = ()
    area_affects: Affects = Affects()
    sweep: SweepRecord | None = None
    search: Search | None = None
    bounce: bool = False
    returns: bool = False


@dataclass(frozen=True, slots=True)
class Weapon:
    """A weapon: reach, rhythm and the hits of one shot. ``row`` is its index in ``Catalog.weapons``.

    ``hidden`` ones are not in the API (a Roach's bite), ``disabled`` ones need to be switched on, ``passive`` ones only
    aim. ``moves`` says what the body does while it fires: it stands (""), glides on ("slowing") or goes where it wants
    ("moving"). ``excluding`` is an attribute it can't be aimed at, ``acquires`` what it picks by itself ("any" or
    "unit", which is no structure), ``launches`` the unit type that an attack sends out. One that ``bursts`` loses the
    hits that are still to come when its attack ends.
    """

    row: int
    id: str
    targets: str
    range: float
    period_loops: float
    damage_point_loops: float
    backswing_loops: float
    jitter_loops: tuple[float, float]
    hits: tuple[Hit, ...]
    shown_damage: float
    shown_attacks: int
    shown_bonus: tuple[tuple[str, float], ...]
    min_range: float = 0.0
    slop: float = 0.0
    bursts: bool = False
    scan: float = 5.0
    arc_deg: float = 0.0
    arc_slop_deg: float = 11.25
    turret_deg_n: float | None = None
    melee: bool = False
    hidden: bool = False
    disabled: bool = False
    passive: bool = False
    fires_moving: bool = False
    strafe: bool = False
    moves: str = ""
    excluding: str = ""
    acquires: str = "any"
    launches: str = ""
    estimates: tuple[str, ...] = ()

    def reaches(self, plane: str) -> bool:
        """Return whether it can be aimed at a unit on ``plane`` ("ground" or "air")."""
        return self.targets in ("any", plane)

    def rate_against(self, unit: UnitType) -> float:
        """Return the damage per loop to a unit of a type, before upgrades."""
        bonus = max((amount for name, amount in self.shown_bonus if name in unit.attributes), default=0.0)
        return self.shown_attacks * max(self.shown_damage + bonus - unit.armor, 0.0) / self.period_loops

    @property
    def is_beam(self) -> bool:
        """Whether it goes on by itself once it has begun, tick after tick."""
        return any(hit.beam_tick_n is not None for hit in self.hits)

    @property
    def is_kamikaze(self) -> bool:
        """Whether firing it kills the unit."""
        return any(hit.kills_self for hit in self.hits)

    @property
    def works(self) -> bool:
        """Whether an attack with it does anything: it deals damage or launches units."""
        return bool(self.hits or self.launches) and not self.passive


@dataclass(frozen=True, slots=True)
class ProductionRecord:
    """One way to make a unit type, with its price."""

    producer: str
    ability: int
    kind: str
    loops: float = 0.0
    cost: tuple[int, int] = (0, 0)
    count: int = 1
    requires: str = ""


@dataclass(frozen=True, slots=True)
class UnitType:
    """A unit type; ``row`` is its index in ``Catalog.units``, ``id`` the number that the API uses.

    ``cost`` is cumulative (a Baneling's includes its Zergling), as in the API; ``made_by`` has the price of one
    production. ``radius`` is the body used by the rules, ``radius_shown`` the one the API reports. A type that is
    ``like`` another is a copy of it that a map has made; ``passive`` ones never cast or, but for a turret, fight by
    themselves.
    """

    row: int
    id: int
    name: str
    race: str
    life: float
    radius: float
    attributes: tuple[str, ...] = ()
    planes: tuple[str, ...] = ()
    collide: tuple[str, ...] = ()
    flying: bool = False
    structure: bool = False
    life_start: float | None = None
    life_regen_n: float = 0.0
    life_regen_delay_n: float = 0.0
    armor: float = 0.0
    shields: float = 0.0
    shields_start: float | None = None
    shield_armor: float = 0.0
    shield_regen_n: float = 0.0
    shield_regen_delay_n: float = 0.0
    energy: float = 0.0
    energy_start: float = 0.0
    energy_regen_n: float = 0.0
    speed_n: float = 0.0
    acceleration_n: float = 0.0
    deceleration_n: float = 0.0
    turn_deg_n: float = 0.0
    turn_still_deg_n: float | None = None
    creep_factor: float = 1.0
    mover: str = ""
    push: int = 10
    radius_api: float | None = None
    separation: float = 0.0
    inner: float | None = None
    height: float = 0.0
    sight: float = 0.0
    detect: float = 0.0
    cargo_size: int = 0
    cargo_space: int = 0
    cargo_max_size: int = 0
    cargo_range: float = 0.0
    unload_period_n: float = 0.0
    supply: float = 0.0
    provides: float = 0.0
    cost: tuple[int, int] = (0, 0)
    build_loops: float = 0.0
    repair_n: float = 0.0
    ability: int = 0
    tech_requirement: int = 0
    require_attached: bool = False
    unit_alias: int = 0
    tech_alias: tuple[int, ...] = ()
    made_by: tuple[ProductionRecord, ...] = ()
    priority: int = 0
    defensive: bool = False
    passive: bool = False
    like: str = ""
    flees: bool = False
    weapons: tuple[Weapon, ...] = ()
    footprint: str = ""
    placement: str = ""
    resource: str = ""
    resource_amount: int = 0
    per_trip: int = 0
    harvest_loops: float = 0.0
    ideal_harvesters: int = 0
    power: tuple[tuple[float, int], ...] = ()
    needs_power: bool = False
    needs_creep: bool = False
    makes_creep: bool = False
    cloaked: bool = False
    burrowed: bool = False
    army: bool = False
    worker: bool = False
    invulnerable: bool = False
    untargetable: bool = False
    unselectable: bool = False
    uncommandable: bool = False
    unturnable: bool = False
    always_threatens: bool = False
    prevents_defeat: bool = False
    no_score: bool = False
    created_visible: bool = False
    score_make: float = 0.0
    score_kill: float = 0.0
    subgroup: int = 0
    not_in_melee: bool = False

    @property
    def radius_shown(self) -> float:
        """The radius that the API reports: the footprint's for structures, the body's otherwise."""
        return self.radius if self.radius_api is None else self.radius_api

    @property
    def underfoot(self) -> bool:
        """Whether units walk over it though it keeps others from building there: a lowered depot."""
        return self.footprint.endswith("Underground")

    @property
    def repair_loops(self) -> float:
        """Loops in which one worker repairs all its life; its production time where the data has none."""
        return self.repair_n * 16.0 or self.build_loops

    def weapon_against(self, plane: str) -> Weapon | None:
        """Return the weapon with the longest range that a unit of this type can aim at ``plane`` by itself, or None."""
        usable = [w for w in self.weapons if w.reaches(plane) and w.works and not w.disabled]
        return max(usable, key=lambda weapon: weapon.range, default=None)


@dataclass(frozen=True, slots=True)
class Change:
    """One field that an upgrade changes: ``op`` is ``add``, ``subtract`` or ``set``."""

    catalog: str
    entry: str
    field: str
    op: str
    value: float | str


@dataclass(frozen=True, slots=True)
class Upgrade:
    """A research result, its price and its changes."""

    id: int
    name: str
    researchable: bool = False
    cost: tuple[int, int] = (0, 0)
    loops: float = 0.0
    ability: int = 0
    at: tuple[str, ...] = ()
    requires: str = ""
    changes: tuple[Change, ...] = ()


@dataclass(frozen=True, slots=True)
class UnitFootprint:
    """The cells that a structure blocks, relative to its centre.

    ``cells`` holds ``(dx, dy)`` of each blocked cell's lower-left corner from the centre, ``around`` the same of cells
    where no town hall may stand near a resource; ``area`` is ``(x0, y0, x1, y1)`` of the mask in the same frame.
    ``forbids`` and ``requires`` are what the ground under the cells must not and must be, in the catalog's words.
    """

    id: str
    area: tuple[int, int, int, int]
    cells: tuple[tuple[int, int], ...]
    around: tuple[tuple[int, int], ...] = ()
    forbids: frozenset[str] = frozenset()
    requires: frozenset[str] = frozenset()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in cells of the blocked part; a sieged tank's mask blocks nothing."""
        if not self.cells:
            return 0, 0
        xs, ys = zip(*self.cells, strict=True)
        return max(xs) - min(xs) + 1, max(ys) - min(ys) + 1
