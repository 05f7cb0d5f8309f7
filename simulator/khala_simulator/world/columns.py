"""Columns: what is known of every unit slot, one array each.

Only the arrays: ``world`` says when units come and go, ``systems`` what the numbers do. Each line declares a column
with the type of its numbers, what an unused slot holds (0 if nothing is said), and ``width=2`` for points and vectors,
whose arrays are (capacity, 2); all others are (capacity,). Distances are world units, times game loops.

``state`` is what decides the future and is part of the world's digest. ``trait`` follows from it: from type, owner,
upgrades and order, or it is written again in every loop before it is read.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

NOBODY: Final = -1  # no slot
INDEX_SHIFT: Final = 18  # of the slot in a tag
SLOT_BITS: Final = 0x3FFF  # of the slot, once shifted
LONG_AGO: Final = -(1 << 30)
DTYPES: Final[dict[type, type[np.generic]]] = {bool: np.bool_, int: np.int64, float: np.float64}


@dataclass(frozen=True, slots=True)
class ColumnSpec:
    """How one column is made: its dtype, the value of an unused slot, numbers per slot, and whether it is state."""

    dtype: type[np.generic]
    empty: float
    width: int
    is_state: bool

    def make(self, capacity: int) -> NDArray[Any]:
        """Return a fresh array of unused slots."""
        return np.full((capacity, self.width) if self.width else capacity, self.empty, dtype=self.dtype)


def state(of: type, empty: float = 0, *, width: int = 0) -> Any:
    """Declare a column that decides the future."""
    return ColumnSpec(DTYPES[of], empty, width, is_state=True)


def trait(of: type, empty: float = 0, *, width: int = 0) -> Any:
    """Declare a column that follows from others."""
    return ColumnSpec(DTYPES[of], empty, width, is_state=False)


class Native(Protocol):
    """The columns as compiled code sees them."""

    def clear(self, slot: int) -> None:
        """Make a slot unused."""


class UnitColumns:
    """The columns, their growth and their emptying; slots are row numbers."""

    alive: Bools = state(bool)
    tag: Ints = state(int)  # the API's 64-bit tag, 0 where the slot is free
    type: Ints = state(int)  # row in catalog.units
    owner: Ints = state(int)  # player id, 0 neutral
    pos: Floats = state(float, width=2)  # world units
    heading: Floats = state(float, width=2)  # unit vector the body faces
    speed: Floats = state(float)  # world units per loop, now
    life: Floats = state(float)
    shields: Floats = state(float)
    energy: Floats = state(float)
    build_progress: Floats = state(float, 1)  # 0..1, 1 is complete
    burrowed: Bools = state(bool)
    hallucination: Bools = state(bool)
    born_loop: Ints = state(int)
    expires: Ints = state(int)  # loop at which its timed life ends, 0 without one
    carrier: Ints = state(int, NOBODY)  # slot of the unit that it is inside, or NOBODY
    addon: Ints = state(int, NOBODY)  # slot of the add-on at its side, or NOBODY
    home: Ints = state(int, NOBODY)  # slot of the unit that it belongs to and comes back to, or NOBODY
    barrier: Floats = state(float)  # damage that a barrier around it still takes
    damaged_loop: Ints = state(int, LONG_AGO)  # last loop with damage to it
    order_kind: Ints = state(int)  # OrderKind
    order_ability: Ints = state(int)  # specific ability id, 0 when idle
    order_target: Ints = state(int, NOBODY)  # slot or NOBODY
    order_point: Floats = state(float, width=2)
    order_aimed: Bools = state(bool)  # the point was given with the order
    order_origin: Floats = state(float, width=2)  # the other end of a patrol
    cast_at: Floats = state(float, -1)  # loop at which the ability it uses takes effect, -1 before it begins
    cast_begun: Floats = state(float, -1)  # loop at which it began to prepare that
    channels: Bools = state(bool)  # that effect has come and goes on
    bound: Bools = state(bool)  # what it does can't be broken off: other orders wait behind it
    listed_last: Bools = state(bool)  # in an observation; see api.sight
    target: Ints = state(int, NOBODY)  # slot the weapon is engaged with, or NOBODY
    attacker: Ints = state(int, NOBODY)  # slot that damaged it last, or NOBODY
    scan_loop: Ints = state(int)  # loop from which it looks for a target again
    on_guard: Bools = state(bool)  # it has been idle since it fought its way to a point
    guard: Floats = state(float, width=2)  # where an idle unit stood when it engaged a target by itself
    returning: Bools = state(bool)  # an idle unit that will go back there after the fight
    leashed: Bools = state(bool)  # it gave up a chase and ignores enemies until it is nearly back
    bursting: Bools = state(bool)  # later hits of its last attack are still to come; they end with the attack
    reached: Bools = state(bool)  # the target has been in reach since it was chosen
    weapon: Ints = state(int, -1)  # row of the weapon for that target, or -1
    reach: Floats = state(float)  # its range, edge to edge
    reach_min: Floats = state(float)  # and the range below which it can't fire, -inf without one
    slop: Floats = state(float)  # how far beyond its range it fires on at a target that it has had in reach
    aim_cos: Floats = state(float, -1)  # cosine of the largest angle between body or turret and target
    turreted: Bools = state(bool)  # that weapon sits on a turret
    rolling: Bools = state(bool)  # the body goes where it wants while that weapon fires
    beaming: Bools = state(bool)  # its beam is on the target
    turret: Floats = state(float, width=2)  # unit vector the turret points along
    weapon_toggles: Ints = state(int)  # bit i: the i-th weapon of its type is on where the type says off, or off
    spent: Bools = state(bool)  # it died of its own attack
    cooldown: Floats = state(float)  # loops until the next attack may start
    windup: Floats = state(float, -1)  # loops until the started attack takes effect, -1 when none is started
    backswing: Floats = state(float)  # loops the body stays in the finished attack unless ordered away
    build_loops: Floats = state(float)  # loops that its construction takes in all, 0 when it is complete
    self_made: Bools = state(bool)  # its construction goes on by itself
    site: Ints = state(int, NOBODY)  # slot of the structure that it is building, or NOBODY
    worked: Ints = state(int, LONG_AGO)  # last loop in which a unit built it
    harvest: Ints = state(int)  # harvesting.Phase, 0 when it does not gather
    patch: Ints = state(int, NOBODY)  # slot of the resource that it harvests, or NOBODY
    occupant: Ints = state(int, NOBODY)  # slot of the worker that is at this resource now, or NOBODY
    load: Ints = state(int)  # resources that it carries
    contents: Ints = state(int)  # resources that are left in it
    work_until: Floats = state(float)  # loop at which it is done at its resource
    zone: Floats = state(float, width=2)  # middle of the only circle in which it fires
    zone_radius: Floats = state(float)  # that circle's radius, 0 for units that fire anywhere
    help_loop: Ints = state(int, LONG_AGO)  # last loop this unit called for help
    nav_point: Floats = state(float, width=2)  # next corner of the path
    nav_loop: Ints = state(int)  # loop at which the path is checked again
    nav_straight: Bools = state(bool)  # the straight line to the goal is free
    nav_end: Bools = state(bool)  # no way leads nearer to the goal
    nav_goal: Floats = state(float, width=2)  # the goal, or what can be reached nearest to it
    nav_best: Floats = state(float)  # the least distance from there since the way was begun
    nav_best_loop: Ints = state(int)  # and when that was
    blocked: Ints = state(int)  # loops without progress in a row
    detour: Ints = state(
        int
    )  # side on which it goes around bodies, -1 right, 1 left, twice that while it follows a flow, 0 none
    detour_end: Ints = state(int)  # loop at which it forgets that side
    aside: Floats = state(float, width=2)  # heading around bodies, zero when the way itself is free
    gap: Floats = state(float)  # distance to its target this loop, edge to edge
    toward: Floats = trait(float, width=2)  # unit vector to its target this loop
    in_reach: Bools = state(bool)  # its target is within the weapon's reach this loop
    intended: Floats = state(float, width=2)  # the step it takes this loop if nothing is in the way

    radius: Floats = trait(float)  # body for ranges
    separation: Floats = trait(float)  # body for pushing
    clearance: Floats = trait(float)  # body for cliffs
    lightness: Floats = trait(float, 1)  # how much more easily it is pushed than an ordinary unit
    layer: Ints = trait(int)  # Layer the unit moves on
    layer_bits: Ints = trait(int)  # stats.LAYERS it collides in
    plane_bits: Ints = trait(int)  # planes on which it can be hit
    step_max: Floats = trait(float)  # world units per loop
    step_gain: Floats = trait(float)  # world units per loop, per loop
    step_loss: Floats = trait(float)  # world units per loop, per loop, when it brakes
    glides: Bools = trait(bool)  # it flies and needs time to stop
    turn_cos: Floats = trait(float)  # cosine and
    turn_sin: Floats = trait(float)  # sine of the largest turn per loop while it walks
    turn_still_cos: Floats = trait(float)  # and while
    turn_still_sin: Floats = trait(float)  # it stands
    priority: Floats = trait(float)  # as a target
    ground_weapon: Ints = trait(int, -1)  # row of the weapon against ground units, or -1
    air_weapon: Ints = trait(int, -1)
    close_weapon: Ints = trait(int, -1)  # row of the one that takes over when the target stands close, or -1
    close_range: Floats = trait(float)
    least_range: Floats = trait(float)  # below this gap no weapon reaches, 0 for nearly every unit
    guns_walking: Bools = trait(bool)  # it fires at what it passes while it walks
    spares_structures: Bools = trait(bool)  # it does not pick structures by itself
    turret_cos: Floats = trait(float)  # cosine and
    turret_sin: Floats = trait(float)  # sine of the turret's largest turn per loop
    ground_scan: Floats = trait(float)  # how far it looks for ground targets, edge to edge, -1 without a weapon
    air_scan: Floats = trait(float)
    acquires: Bools = trait(bool)  # it picks fights by itself
    threat_bits: Ints = trait(int)  # planes on which units fear it
    defensive: Bools = trait(bool)  # it picks fights only on order, and threatens only the unit that it attacks
    flees: Bools = trait(bool)  # attacked while idle it runs
    targetable: Bools = trait(bool)  # it may be a target at all
    cloaked: Bools = trait(bool)  # seen by detectors only
    sight: Floats = trait(float)  # world units
    detects: Floats = trait(float)  # radius in which its owner sees what is cloaked, 0 without
    can_act: Bools = trait(bool)  # it is finished, and neither stunned nor out of its owner's hands
    can_attack: Bools = trait(bool)
    can_cast: Bools = trait(bool)
    casts: Bools = trait(bool)  # its order is to use an ability
    attack_rate: Floats = trait(float, 1)  # times the ordinary one
    range_add: Floats = trait(float)  # to every weapon's range
    armor_add: Floats = trait(float)
    shield_armor_add: Floats = trait(float)
    ranged_add: Floats = trait(float)  # to the damage of every ranged hit that it takes, before armor
    melee_add: Floats = trait(float)  # to that of every melee hit
    taken_factor: Floats = trait(float, 1)  # times the damage that it takes
    air_taken_factor: Floats = trait(float, 1)  # and times that of hits, not spells, of flyers
    dealt_factor: Floats = trait(float, 1)  # times the damage that it deals
    bonus_bits: Ints = trait(int)  # attributes (bits) against which its hits deal
    bonus_add: Floats = trait(float)  # more damage, before armor
    walks: Bools = trait(bool)  # its order is to walk to a point
    looks_around: Bools = trait(bool)  # its order allows it to pick fights
    holds: Bools = trait(bool)  # its order is to stay on the spot
    needs_target: Bools = trait(bool)  # its order ends with its target
    wants: Bools = trait(bool)  # it wants to move this loop
    goal: Floats = trait(float, width=2)  # and where to
    stop_at: Floats = trait(float)  # distance from the goal, centre to centre, at which it stops
    work_rate: Floats = trait(float, 1)  # loops of production that pass in one loop
    powered: Bools = trait(bool, 1)  # it stands in a power field, or needs none
    creep_factor: Floats = trait(float, 1)  # speed on creep, times the ordinary one
    life_max: Floats = trait(float)
    life_regen: Floats = trait(float)  # per loop
    life_delay: Floats = trait(float)  # loops without damage before it begins
    shields_max: Floats = trait(float)
    shield_regen: Floats = trait(float)  # per loop
    shield_delay: Floats = trait(float)
    energy_max: Floats = trait(float)
    energy_regen: Floats = trait(float)  # per loop
    walled: Bools = trait(bool)  # it stands on a footprint, which blocks the ground for others
    walls: Floats = trait(float, width=2)  # half the width and height of that footprint

    def __init__(self) -> None:
        self.capacity = 0
        self.native: Native | None = None  # the arrays as compiled code sees them, bound when it needs them

    def grow(self, capacity: int) -> None:
        """Make room for ``capacity`` slots; the values stay, the arrays are new."""
        for name, column in COLUMNS.items():
            array = column.make(capacity)
            if self.capacity:
                array[: self.capacity] = getattr(self, name)
            setattr(self, name, array)
        self.capacity = capacity
        self.native = None

    def clear(self, slot: int) -> None:
        """Make a slot unused."""
        if self.native is not None:
            self.native.clear(slot)
            return
        for name, column in COLUMNS.items():
            getattr(self, name)[slot] = column.empty

    def state_bytes(self, slots: int) -> bytes:
        """Return the state of the first ``slots`` slots, column by column."""
        return b"".join(getattr(self, name)[:slots].tobytes() for name, column in COLUMNS.items() if column.is_state)


COLUMNS: Final[dict[str, ColumnSpec]] = {k: v for k, v in vars(UnitColumns).items() if isinstance(v, ColumnSpec)}
