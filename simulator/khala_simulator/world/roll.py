"""The roll of a world: its slots and its living units, and what it notes of them when one comes, goes or changes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.native import columns
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.world.world import World


def call(world: World) -> None:
    """List who lives, outside of all carriers, and note for which rules there is a unit at all."""
    c = columns.columns_of(world)
    live: list[int] = []
    shields = life = energy = mortal = hiding = False
    for slot in range(world.top):
        if c.alive[slot] and c.carrier[slot] == NOBODY:
            live.append(slot)
        shields |= c.shield_regen[slot] != 0.0
        life |= c.life_regen[slot] != 0.0
        energy |= c.energy_regen[slot] != 0.0
        mortal |= c.expires[slot] != 0
        hiding |= c.cloaked[slot] or c.burrowed[slot]
    world.live = np.array(live, dtype=np.int64)
    world.regenerating = shields, life, energy
    world.mortal = mortal
    world.hiding = hiding


def free_slot(world: World) -> int:
    """Return the first slot that is free, or the first that was never used."""
    c = columns.columns_of(world)
    for slot in range(1, world.top):
        if not c.alive[slot]:
            return slot
    return world.top


def passengers(world: World, carrier: int) -> list[int]:
    """Return the slots of the units inside a carrier, ascending."""
    c = columns.columns_of(world)
    return [slot for slot in range(world.top) if c.alive[slot] and c.carrier[slot] == carrier]


def forget(world: World, slot: int) -> None:
    """Make every reference to a unit that is gone NOBODY."""
    end_fights_with(world, slot)
    c = columns.columns_of(world)
    for other in range(world.top):
        if c.attacker[other] == slot:
            c.attacker[other] = NOBODY
        if c.carrier[other] == slot:
            c.carrier[other] = NOBODY
        if c.addon[other] == slot:
            c.addon[other] = NOBODY
        if c.home[other] == slot:
            c.home[other] = NOBODY
        if c.site[other] == slot:
            c.site[other] = NOBODY
        if c.patch[other] == slot:
            c.patch[other] = NOBODY
        if c.occupant[other] == slot:
            c.occupant[other] = NOBODY


def end_fights_with(world: World, slot: int) -> None:
    """Take its target from whoever fights or follows a unit; workers look again before they end an attack-move."""
    c = columns.columns_of(world)
    for other in range(world.top):
        if c.target[other] == slot:
            c.target[other] = NOBODY
            c.in_reach[other] = False
            if c.defensive[other]:
                c.scan_loop[other] = 0
        if c.order_target[other] == slot:
            c.order_target[other] = NOBODY
