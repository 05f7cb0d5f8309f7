"""Launchers: the rules at the damage point of weapons that send out units instead of hitting.

Only the table: ``systems.weapons`` looks rules up here, and the skills of the launched units add theirs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.world.world import World

LAUNCHERS: Final[dict[str, Callable[[World, int, int], None]]] = {}
"""By the weapon's id: a function of the world, attacker and target."""
