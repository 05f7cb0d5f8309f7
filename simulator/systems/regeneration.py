"""Regeneration: shields after a pause without damage, life and energy all the time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from simulator.world import World


def regenerate(world: World) -> None:
    """Give every unit this loop's shields, life and energy, up to what its type holds."""
    n = world.top
    for amount, most, rate, delay in (
        (world.shields[:n], world.shields_max[:n], world.shield_regen[:n], world.shield_delay[:n]),
        (world.life[:n], world.life_max[:n], world.life_regen[:n], world.life_delay[:n]),
        (world.energy[:n], world.energy_max[:n], world.energy_regen[:n], None),
    ):
        below = (amount < most) & (rate > 0.0)
        if not below.any():
            continue
        if delay is not None:
            below &= world.loop - world.damaged_loop[:n] > delay
        below &= world.life[:n] > 0.0
        amount[below] = np.minimum(amount[below] + rate[below], most[below])
