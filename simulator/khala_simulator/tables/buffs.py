"""Kinds of buffs: how the tables say they change a unit's numbers or what it may do.

``active_buffs`` holds the ones of each unit; the rules are in ``buffs`` and ``traits``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

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
    """One kind of buff; ``id`` is the API's number or 0 where clients do not see it.

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
    lights: float = 0.0  # radius around its bearer in which its caster's owner sees the ground
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
    """Return the record in one row of ``buffs.json``."""
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
