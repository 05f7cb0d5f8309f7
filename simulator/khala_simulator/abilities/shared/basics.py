"""Skills that units of every race have: changing mode, and buffs that only need to be applied.

A morph is an ability whose time passes while the unit stands still; then the unit changes its type.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.shared.push_units_off import push_units_off
from khala_simulator.abilities.skill import Skill
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.movement import pathfinding
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.layers import Layer

if TYPE_CHECKING:
    from khala_simulator.abilities.skill import Effect
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World


def on_self(buff: str) -> Effect:
    """Return an effect that applies a buff to the caster, for as long as the ability or else the buff says."""

    def effect(world: World, cast: Cast) -> None:
        """Apply a buff to the caster for a time."""
        loops = cast.ability.numbers.get("duration_loops")
        buffs.apply(world, cast.slot, buff, source=cast.slot, loops=loops)

    return effect


def on_target(buff: str) -> Effect:
    """Return an effect that applies a buff to the target."""

    def effect(world: World, cast: Cast) -> None:
        """Apply a buff to the target for a time."""
        loops = cast.ability.numbers.get("duration_loops")
        buffs.apply(world, cast.target, buff, source=cast.slot, loops=loops)

    return effect


def off_self(buff: str) -> Effect:
    """Return an effect that removes a buff from the caster."""

    def effect(world: World, cast: Cast) -> None:
        """Remove a buff from the caster."""
        buffs.remove(world, cast.slot, buff)

    return effect


def _morph(world: World, cast: Cast) -> None:
    """Become the type that the ability makes; its time has already passed (see ``casting.prep_loops``)."""
    lifecycle.become(world, cast.slot, world.catalog.unit(cast.ability.unit))
    push_units_off(world, cast.slot)


def _can_morph(world: World, cast: Cast) -> ActionResult:
    row = world.catalog.row_of_name.get(cast.ability.unit)
    if row is None:
        return ActionResult.NOT_SUPPORTED
    lands = world.unit_type(cast.slot).flying and not world.catalog.units[row].flying
    return (
        ActionResult.CANT_LAND_LOCATION_INVALID if lands and not _walkable(world, cast.slot) else ActionResult.SUCCESS
    )


def _walkable(world: World, slot: int) -> bool:
    """Return whether the ground under a flyer is walkable."""
    surface = pathfinding.surface(world.ground, Layer.WALK)
    return bool(surface.flat[surface.cell(world.pos[slot][None])][0])


SKILLS: Final = {
    "morph": Skill(_morph, refuse=_can_morph, binds=True),
}
