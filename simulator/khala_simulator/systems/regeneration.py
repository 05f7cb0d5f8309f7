"""Regeneration: shields after a pause without damage, life and energy all the time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from khala_simulator.numeric.arrays import which

if TYPE_CHECKING:
    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.world.world import World


def regenerate(world: World) -> None:
    """Give every unit this loop's shields, life and energy, up to what its type holds."""
    shields, life, energy = world.regenerating
    if shields:
        _regain(world, world.shields, world.shields_max, world.shield_regen, world.shield_delay)
    if life:
        _regain(world, world.life, world.life_max, world.life_regen, world.life_delay)
    if energy:
        _regain(world, world.energy, world.energy_max, world.energy_regen, None)
        _drain(world)


def _regain(world: World, amount: Floats, most: Floats, rate: Floats, delay: Floats | None) -> None:
    n = world.top
    slots = which(amount[:n] < most[:n])
    slots = slots[rate.take(slots) > 0.0]
    if delay is not None and slots.size:
        slots = slots[world.damaged_loop.take(slots) < world.loop - delay.take(slots)]
    if not slots.size:
        return
    slots = slots[world.life.take(slots) > 0.0]
    amount[slots] = np.minimum(amount.take(slots) + rate.take(slots), most.take(slots))


def _drain(world: World) -> None:
    """Take energy from units that spend more than they regain; the rule that makes them spend checks the rest."""
    n = world.top
    slots = which(world.energy_regen[:n] < 0.0)
    if slots.size:
        world.energy[slots] = np.maximum(world.energy.take(slots) + world.energy_regen.take(slots), 0.0)
