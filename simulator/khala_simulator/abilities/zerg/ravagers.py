"""The Ravager's Corrosive Bile: the place where it will land is visible, and it hits friend and foe."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.skill import Skill, around, lay, number
from khala_simulator.combat.damage import apply_damage

if TYPE_CHECKING:
    from khala_simulator.world.area_effects import AreaEffect
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

BILE_EFFECT = 11


def _bile(world: World, cast: Cast) -> None:
    """Harm every unit at the place some time later, and destroy force fields there."""
    rises, falls = number(cast, "delay_loops"), number(cast, "fall_loops")
    due = world.loop + rises + falls
    lay(world, cast, "corrosive_bile", end=due, due=due, effect=BILE_EFFECT)


def _falls(world: World, item: AreaEffect) -> None:
    damage = number(world.catalog.ability(item.ability), "damage")
    for slot in around(world, item.at, item.radius):
        apply_damage(world, world.slot_of(item.source), item.owner, slot, damage)
    fields_of_force = world.live[world.type[world.live] == world.catalog.unit("ForceField").row]
    for slot in fields_of_force.tolist():
        x, y = world.pos[slot].tolist()
        if (x - item.at[0]) ** 2 + (y - item.at[1]) ** 2 <= (item.radius + float(world.radius[slot])) ** 2:
            world.life[slot] = 0.0


SKILLS: Final = {
    "ravager_corrosive_bile": Skill(_bile, estimates=("The bile falls for 8 loops after its two seconds in the air.",)),
}
AREA_EFFECTS: Final = {"corrosive_bile": _falls}
