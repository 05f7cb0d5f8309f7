"""The stock of units: who is there, and what some of them have, looked over after a unit came, went or changed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.native import columns, memory
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.world.world import World


def look_over(world: World) -> None:
    """Write ``live``, the slots of all units that are not inside another one, and what any unit has."""
    c = columns.columns_of(world)
    n = world.top
    count = 0
    shields = False
    life = False
    energy = False
    mortal = False
    hiding = False
    for slot in range(n):
        count += c.alive[slot] and c.carrier[slot] == NOBODY
        shields = shields or c.shield_regen[slot] != 0.0
        life = life or c.life_regen[slot] != 0.0
        energy = energy or c.energy_regen[slot] != 0.0
        mortal = mortal or c.expires[slot] != 0
        hiding = hiding or c.cloaked[slot] or c.burrowed[slot]
    live = memory.new_ints(count)
    slots = memory.ints(live)
    count = 0
    for slot in range(n):
        if c.alive[slot] and c.carrier[slot] == NOBODY:
            slots[count] = slot
            count += 1
    world.live = live
    world.regenerating = (shields, life, energy)
    world.mortal = mortal
    world.hiding = hiding


def forget(world: World, gone: int) -> None:
    """Take a unit that is gone out of every reference to its slot."""
    c = columns.columns_of(world)
    for slot in range(world.top):
        if c.target[slot] == gone:
            c.target[slot] = NOBODY
            c.in_reach[slot] = False
        if c.order_target[slot] == gone:
            c.order_target[slot] = NOBODY
        if c.attacker[slot] == gone:
            c.attacker[slot] = NOBODY
        if c.carrier[slot] == gone:
            c.carrier[slot] = NOBODY
        if c.addon[slot] == gone:
            c.addon[slot] = NOBODY
        if c.home[slot] == gone:
            c.home[slot] = NOBODY
        if c.site[slot] == gone:
            c.site[slot] = NOBODY
        if c.patch[slot] == gone:
            c.patch[slot] = NOBODY
        if c.occupant[slot] == gone:
            c.occupant[slot] = NOBODY
