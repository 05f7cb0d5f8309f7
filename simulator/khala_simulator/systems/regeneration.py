"""Regeneration: shields after a pause without damage, life and energy all the time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.native import columns

if TYPE_CHECKING:
    from khala_simulator.native.columns import Columns
    from khala_simulator.world.world import World


def regenerate(world: World) -> None:
    """Give every unit this loop's shields, life and energy, up to what its type holds."""
    shields, life, energy = world.regenerating
    if not (shields or life or energy):
        return
    c = columns.columns_of(world)
    loop = world.loop
    for slot in range(world.top):
        if c.life[slot] <= 0.0:
            continue
        if shields and c.damaged_loop[slot] < loop - c.shield_delay[slot]:
            _regain_shields(c, slot)
        if life and c.damaged_loop[slot] < loop - c.life_delay[slot]:
            _regain_life(c, slot)
        if energy:
            _regain_energy(c, slot)
    if energy:
        for slot in range(world.top):
            if c.energy_regen[slot] < 0.0:  # the rule that makes it spend checks the rest
                c.energy[slot] = max(c.energy[slot] + c.energy_regen[slot], 0.0)


def _regain_shields(c: Columns, slot: int) -> None:
    if c.shields[slot] < c.shields_max[slot] and c.shield_regen[slot] > 0.0:
        c.shields[slot] = min(c.shields[slot] + c.shield_regen[slot], c.shields_max[slot])


def _regain_life(c: Columns, slot: int) -> None:
    if c.life[slot] < c.life_max[slot] and c.life_regen[slot] > 0.0:
        c.life[slot] = min(c.life[slot] + c.life_regen[slot], c.life_max[slot])


def _regain_energy(c: Columns, slot: int) -> None:
    if c.energy[slot] < c.energy_max[slot] and c.energy_regen[slot] > 0.0:
        c.energy[slot] = min(c.energy[slot] + c.energy_regen[slot], c.energy_max[slot])
