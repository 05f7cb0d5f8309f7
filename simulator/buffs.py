"""Buffs: what lies on a unit for a time and changes its numbers or what it may do.

A ``Buff`` is the kind, as the tables tell it; ``Buffs`` holds the ones in force, a row each. What they change is
written into the trait columns by ``traits``, when a buff comes or goes and not in every loop; ``systems.ailments``
lets them run out. Who lays one on whom is the skills' matter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from simulator.columns import NOBODY

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from simulator.world import World

FRENZIED: Final = frozenset({"Ultralisk", "UltraliskBurrowed"})
"""Types that the catalog gives the behaviour Frenzy."""
FOREVER: Final = 1 << 40  # end of a buff that does not run out
FLAGS: Final = (
    "stunned", "disarmed", "rooted", "unturning", "silenced", "invulnerable", "cloak", "uncloaked", "revealed",
    "detected", "blind", "detector", "stasis", "passive", "benign", "bodiless", "uncommandable", "no_passenger",
    "no_life_regen", "no_shield_regen", "no_energy_regen", "spares_frenzied", "lifted",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Response:
    """What a buff does to damage that its bearer takes (``on`` defender) or deals (attacker).

    ``add`` to and ``factor`` of each hit, except hits of ``not_kinds`` (ranged, melee, spell, splash, noproc);
    ``limit`` is how much a barrier takes in all. With ``from_air`` only hits of flyers count.
    """

    on: str = "defender"
    add: float = 0.0
    factor: float = 1.0
    limit: float = 0.0
    most: float = 0.0
    from_air: bool = False
    not_kinds: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Buff:
    """One kind of buff; ``id`` is the API's number or 0 where clients are not told of it.

    ``loops`` 0 is without an end. Factors multiply, ``_add`` adds; a name ending in ``_n`` is per normal second.
    """

    row: int
    id: int
    name: str
    loops: float = 0.0
    period_loops: float = 0.0
    stacks: int = 1
    speed: float = 1.0
    attack_rate: float = 1.0
    time: float = 1.0
    acceleration: float = 1.0
    work_rate: float = 1.0
    speed_add_n: float = 0.0
    speed_max_n: float | None = None
    speed_min_n: float = 0.0
    acceleration_add_n: float = 0.0
    deceleration_add_n: float = 0.0
    range_add: float = 0.0
    armor_add: float = 0.0
    shield_armor_add: float = 0.0
    sight_add: float = 0.0
    detect: float = 0.0
    lights: float = 0.0  # radius around its bearer in which who laid it on sees the ground
    radar: float = 0.0
    supply: float = 0.0
    life_regen_n: float = 0.0
    shields_regen_n: float = 0.0
    energy_regen_n: float = 0.0
    life_max_add: float = 0.0
    bonus: tuple[tuple[str, float], ...] = ()
    dealt_fraction: tuple[tuple[str, float], ...] = ()
    weapons_on: tuple[str, ...] = ()
    weapons_off: tuple[str, ...] = ()
    flags: frozenset[str] = frozenset()
    response: Response | None = None


def buff_from(row: int, raw: dict[str, Any]) -> Buff:
    """The record in one row of ``buffs.json``."""
    raw = dict(raw)
    response = raw.pop("response", None)
    if response is not None:
        response = Response(**{**response, "not_kinds": tuple(response.get("not_kinds", ()))})
    return Buff(
        row=row,
        bonus=tuple(sorted(raw.pop("bonus", {}).items())),
        dealt_fraction=tuple(sorted(raw.pop("dealt_fraction", {}).items())),
        weapons_on=tuple(raw.pop("weapons_on", ())),
        weapons_off=tuple(raw.pop("weapons_off", ())),
        flags=frozenset(raw.pop("flags", ())),
        response=response,
        **raw,
    )


_ROW: Final = np.dtype(
    [
        ("slot", np.int64),  # who bears it
        ("buff", np.int64),  # row in catalog.buffs
        ("source", np.int64),  # slot of the caster, or NOBODY
        ("owner", np.int64),  # whose unit cast it
        ("begun", np.int64),  # loop
        ("end", np.float64),  # loop, FOREVER without an end
        ("due", np.float64),  # loop of the next period, FOREVER without one
        ("count", np.int64),  # stacks, or ticks done: the skill's own counter
    ]
)


class Buffs:
    """The buffs in force, a row each, in the order in which they came."""

    def __init__(self) -> None:
        self.rows: NDArray[np.void] = np.zeros(0, dtype=_ROW)

    def __len__(self) -> int:
        return len(self.rows)

    def of(self, slot: int) -> NDArray[np.void]:
        """The rows that lie on a unit."""
        found: NDArray[np.void] = self.rows[self.rows["slot"] == slot]
        return found

    def find(self, slot: int, row: int) -> int:
        """Index of the first row of a kind on a unit, or -1."""
        found = np.flatnonzero((self.rows["slot"] == slot) & (self.rows["buff"] == row))
        return int(found[0]) if found.size else -1

    def forget(self, slot: int) -> None:
        """The unit in ``slot`` is gone: what lay on it goes, what it cast stays."""
        if len(self.rows):
            self.rows = self.rows[self.rows["slot"] != slot]
            source = self.rows["source"]
            source[source == slot] = NOBODY

    def content(self) -> bytes:
        """All rows as bytes, for the digest of the world."""
        return self.rows.tobytes()


def apply(
    world: World, slot: int, name: str, *, source: int = NOBODY, owner: int | None = None, loops: float | None = None
) -> None:
    """Lay a buff on a unit, or begin its time anew when it bears one of the kind already.

    Args:
        world: The game.
        slot: Who is to bear it; nobody bears one twice, but kinds that stack count.
        name: Its name in the catalog.
        source: Slot of the unit that casts it.
        owner: Whose unit that is, the source's owner by default.
        loops: How long it lasts, as the catalog says by default; 0 is without an end.
    """
    buff = world.catalog.buff(name)
    if "spares_frenzied" in buff.flags and frenzied(world, slot):
        return
    lasts = buff.loops if loops is None else loops
    end = world.loop + lasts if lasts else FOREVER
    if owner is None:
        owner = int(world.owner[source]) if source != NOBODY else int(world.owner[slot])
    table = world.buffs
    at = table.find(slot, buff.row)
    if at >= 0:
        row = table.rows[at]
        row["end"], row["source"], row["owner"] = max(float(row["end"]), end), source, owner
        row["count"] = min(int(row["count"]) + 1, buff.stacks)
        return
    due = world.loop + buff.period_loops if buff.period_loops else FOREVER
    fresh = np.array([(slot, buff.row, source, owner, world.loop, end, due, 1)], dtype=_ROW)
    table.rows = np.concatenate((table.rows, fresh))
    world.refresh(slot)


def frenzied(world: World, slot: int) -> bool:
    """Whether a unit can be neither slowed nor moved nor taken over: an Ultralisk."""
    return world.unit_type(slot).name in FRENZIED


def remove(world: World, slot: int, name: str) -> bool:
    """Take a buff off a unit; returns whether it bore one."""
    row = world.catalog.buff(name).row
    rows = world.buffs.rows
    mine = (rows["slot"] == slot) & (rows["buff"] == row)
    if not mine.any():
        return False
    world.buffs.rows = rows[~mine]
    world.refresh(slot)
    return True


def has(world: World, slot: int, name: str) -> bool:
    """Whether a unit bears a buff."""
    return len(world.buffs) > 0 and world.buffs.find(slot, world.catalog.buff(name).row) >= 0


def kinds_on(world: World, slot: int) -> list[Buff]:
    """The kinds of buffs on a unit, in the order in which they came."""
    if not len(world.buffs):
        return []
    return [world.catalog.buffs[row] for row in world.buffs.of(slot)["buff"].tolist()]
