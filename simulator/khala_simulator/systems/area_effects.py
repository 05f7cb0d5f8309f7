"""Area effects do their work at their periods, and end."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_simulator.abilities.registry import AREA_EFFECTS

if TYPE_CHECKING:
    from khala_simulator.world.world import World


def run(world: World) -> None:
    """Run the rule of every area effect that is due, in the order of their coming, and remove those that are over."""
    if not world.area_effects:
        return
    for item in list(world.area_effects):
        while item.due <= world.loop and item.due <= item.end:
            item.due += item.period
            rule = AREA_EFFECTS.get(item.rule)
            if rule is not None:
                rule(world, item)
            item.count += 1
    world.area_effects = [item for item in world.area_effects if item.end > world.loop]
