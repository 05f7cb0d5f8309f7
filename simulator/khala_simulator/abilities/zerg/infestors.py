"""The Infestor's skills: Fungal Growth, Neural Parasite, Infested Terrans, Microbial Shroud.

Units under Neural Parasite belong to the Infestor's owner as long as the channel lasts; their buff keeps the former
owner.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.shared import teleport
from khala_simulator.abilities.shared.projectiles import SPEED_UNKNOWN, throw
from khala_simulator.abilities.skill import Skill, around, foes, gap, lay, number
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.combat.damage import apply_damage
from khala_simulator.combat.targets import disengage
from khala_simulator.movement.placement import free_places
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.area_effects import AreaEffect
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import OrderKind

if TYPE_CHECKING:
    import numpy as np

    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

FUNGAL_GROWTH = 74
NEURAL = "NeuralParasite"
SHROUD = "AmorphousArmorcloud"


# Fungal Growth --------------------------------------------------------------------------------------------------------


def _fungal(world: World, cast: Cast) -> None:
    """Throw a growth that harms, slows and uncloaks the enemies it hits."""
    throw(world, cast, "fungal_growth", radius=number(cast, "radius"))


def _grows_over(world: World, item: AreaEffect) -> None:
    source = world.slot_of(item.source)
    for slot in foes(world, around(world, item.at, item.radius, structures=False), item.owner):
        for name in ("FungalGrowth", "FungalGrowthSlowMovement"):
            buffs.apply(world, slot, name, source=source, owner=item.owner)


def _fungal_tick(world: World, slot: int, row: np.void) -> None:
    damage = number(world.catalog.ability(FUNGAL_GROWTH), "damage_per_tick")
    apply_damage(world, int(row["source"]), int(row["owner"]), slot, damage)


# Neural Parasite ------------------------------------------------------------------------------------------------------


def _reach_out(world: World, cast: Cast) -> None:
    """Take over an enemy unit for as long as the Infestor holds still and in reach."""
    throw(world, cast, "neural_parasite")


def _can_reach(world: World, cast: Cast) -> ActionResult:
    target = cast.target
    free = not (buffs.is_frenzied(world, target) or buffs.has(world, target, NEURAL) or world.passengers(target))
    return ActionResult.SUCCESS if free else ActionResult.CANT_TARGET_THAT_UNIT


def _arrives(world: World, item: AreaEffect) -> None:
    slot, target = world.slot_of(item.source), world.slot_of(item.target)
    if NOBODY in (slot, target) or not world.channels[slot] or world.order_target[slot] != target:
        return
    kind = world.catalog.buff(NEURAL)
    was = int(world.owner[target])
    loops = number(world.catalog.ability(item.ability), "duration_loops")
    buffs.apply(world, target, NEURAL, source=slot, loops=loops)
    world.buffs.rows[world.buffs.find(target, kind.row)]["count"] = was
    _hand_over(world, target, item.owner)


def _controls(world: World, cast: Cast) -> bool:
    """Return whether the parasite is on its way, or holds its victim within the leash."""
    slot, target = cast.slot, cast.target
    if world.order_target[slot] != target:
        return False
    tag = world.tag_of(slot)
    if any(item.rule == "neural_parasite" and item.source == tag for item in world.area_effects):
        return True
    return _holder(world, target) == slot and gap(world, slot, target) <= number(cast, "leash_range")


def _holder(world: World, target: int) -> int:
    """Return the slot of the Infestor that holds a unit, or NOBODY."""
    at = world.buffs.find(target, world.catalog.buff(NEURAL).row)
    return int(world.buffs.rows[at]["source"]) if at >= 0 else NOBODY


def _let_go(world: World, cast: Cast) -> None:
    """Give the victim back; the Infestor may be dead, and so may the victim."""
    at = world.buffs.find(cast.target, world.catalog.buff(NEURAL).row)
    if at >= 0 and int(world.buffs.rows[at]["source"]) in (cast.slot, NOBODY):
        was = int(world.buffs.rows[at]["count"])
        buffs.remove(world, cast.target, NEURAL)
        _hand_over(world, cast.target, was)


def _time_is_up(world: World, slot: int, row: np.void) -> None:
    _hand_over(world, slot, int(row["count"]))


def _hand_over(world: World, slot: int, owner: int) -> None:
    """Give a unit to a player: it drops its orders, and its new friends stop attacking it."""
    lifecycle.give(world, slot, owner)
    world.queue[slot] = []
    commands.begin(world, slot, None)
    for other in world.units_of(owner).tolist():
        if world.target[other] == slot:
            if int(world.order_kind[other]) == OrderKind.ATTACK_UNIT:
                commands.begin_next(world, other)
            else:
                disengage(world, other)


def _break_off(world: World, cast: Cast) -> None:
    """Release the victim early."""
    commands.begin_next(world, cast.slot)


def _is_holding(world: World, slot: int, _: Ability) -> ActionResult:
    held = world.channelling.get(slot)
    holding = held is not None and held.ability.effect == "neural_parasite"
    return ActionResult.SUCCESS if holding else ActionResult.CANT_FIND_CANCEL_ORDER


# Infested Terrans -----------------------------------------------------------------------------------------------------


def _infested_terrans(world: World, cast: Cast) -> None:
    """Throw an egg that hatches an infested terran with a timed life."""
    throw(world, cast, "infested_terran_egg")


def _egg_lands(world: World, item: AreaEffect) -> None:
    ability = world.catalog.ability(item.ability)
    egg = world.catalog.unit(str(ability.numbers["egg"]))
    (place,) = free_places(world, egg, item.at, 1)
    slot = lifecycle.spawn(world, egg, item.owner, place)
    hatch = next(a for a in world.catalog.abilities_of(egg.row) if a.unit == "InfestorTerran")
    due = world.loop + hatch.loops
    world.area_effects.append(
        AreaEffect("infested_terran", item.owner, [place], 0.0, world.loop, due, due=due, ability=item.ability,
              target=world.tag_of(slot))
    )  # fmt: skip


def _hatches(world: World, item: AreaEffect) -> None:
    slot = world.slot_of(item.target)
    if slot != NOBODY:
        lifecycle.become(world, slot, world.catalog.unit("InfestorTerran"))
        world.life[slot] = world.life_max[slot]
        teleport.live_until(world, slot, world.loop + number(world.catalog.ability(item.ability), "life_loops"))


# Microbial Shroud -----------------------------------------------------------------------------------------------------


def _shroud(world: World, cast: Cast) -> None:
    """Place a cloud in which ground units take half of the damage of flyers."""
    end = world.loop + number(cast, "duration_loops")
    period = number(cast, "period_loops")
    lay(world, cast, "microbial_shroud", end=end, due=world.loop, period=period)


def _shrouds(world: World, item: AreaEffect) -> None:
    for slot in around(world, item.at, item.radius, plane="ground", structures=False):
        if world.owner[slot]:
            buffs.apply(world, slot, SHROUD, source=world.slot_of(item.source), owner=item.owner)


SKILLS: Final = {
    "fungal_growth": Skill(_fungal, estimates=(SPEED_UNKNOWN,)),
    "neural_parasite": Skill(
        _reach_out,
        refuse=_can_reach,
        hold=_controls,
        end=_let_go,
        estimates=(SPEED_UNKNOWN, "The victim has its new owner's upgrades."),
    ),
    "cancel_neural_parasite": Skill(_break_off, ready=_is_holding),
    "infested_terrans": Skill(_infested_terrans, estimates=(SPEED_UNKNOWN, "An infested terran lives for 480 loops.")),
    "amorphous_armorcloud": Skill(_shroud),
}
AREA_EFFECTS: Final = {
    "fungal_growth": _grows_over,
    "neural_parasite": _arrives,
    "infested_terran_egg": _egg_lands,
    "infested_terran": _hatches,
    "microbial_shroud": _shrouds,
}
TICKS: Final = {"FungalGrowth": _fungal_tick}
ENDS: Final = {NEURAL: _time_is_up}
