"""One use of an ability, as a value: the caster, the ability, and its target."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.tables.abilities import Ability

Point = tuple[float, float]


class Cast(NamedTuple):
    """A unit (slot) uses an ability on a unit (slot), at a point (world), or on nothing.

    ``begun`` is the loop in which it takes effect; a channel goes on from there. ``was`` is the row of the caster's
    type before that.
    """

    slot: int
    ability: Ability
    target: int = NOBODY
    point: Point | None = None
    begun: int = 0
    was: int = -1

    @property
    def is_carried_out(self) -> bool:
        """Whether the caster is at it already, and finds out what its player could not know before."""
        return self.begun > 0
