"""Ravens: auto-turrets, the interference matrix and the anti-armor missile. Detection is in the tables.

Melee games of the shipped versions have no point defence drones, seeker missiles or repair drones.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities.shared import projectiles, teleport
from khala_simulator.abilities.shared.push_units_off import push_units_off
from khala_simulator.abilities.skill import Skill, around, number
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.economy import building_sites
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.tables.catalog import LOOPS_PER_NORMAL_SECOND
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.abilities.skill import AreaEffectRule
    from khala_simulator.world.area_effects import AreaEffect
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

# auto-turret ----------------------------------------------------------------------------------------------------------


def _has_room(world: World, cast: Cast) -> ActionResult:
    if cast.point is None:
        return ActionResult.CANT_BUILD_LOCATION_INVALID
    unit = world.catalog.unit(str(cast.ability.numbers["unit"]))
    owner = int(world.owner[cast.slot])
    return building_sites.refusal(world, owner, unit, cast.point, on_site=cast.is_carried_out)


def _place_turret(world: World, cast: Cast) -> None:
    """Put up a turret that stands for a while and fires at ground and air."""
    assert cast.point is not None
    unit = world.catalog.unit(str(cast.ability.numbers["unit"]))
    turret = lifecycle.spawn(world, unit, int(world.owner[cast.slot]), building_sites.centre(world, unit, cast.point))
    push_units_off(world, turret)
    more = world.stats.with_upgrades(int(world.owner[turret]), "behavior", "AutoTurretTimedLife", "Duration", 0.0)
    lasts = number(cast, "duration_loops") + more * LOOPS_PER_NORMAL_SECOND
    lasts += world.rng.random() * number(cast, "duration_random_loops")
    teleport.live_until(world, turret, world.loop + lasts)


# interference matrix --------------------------------------------------------------------------------------------------

MATRIX: Final = ("RavenScramblerMissile", "RavenScramblerMissileCarrier")
MARKED: Final = "ScramblerMarker"


def _can_be_jammed(world: World, cast: Cast) -> ActionResult:
    """Refuse units neither mechanical nor psionic, and, where markers are known, those jammed or about to be."""
    if cast.target == NOBODY:
        return ActionResult.MUST_TARGET_UNIT
    if not {"mechanical", "psionic"} & set(world.unit_type(cast.target).attributes):
        return ActionResult.MUST_TARGET_MECHANICAL_UNITS
    known = [name for name in (*MATRIX, MARKED) if name in world.catalog.buff_of_name]
    taken = MARKED in known and any(buffs.has(world, cast.target, name) for name in known)
    return ActionResult.ALREADY_TARGETED if taken else ActionResult.SUCCESS


def _jam(world: World, cast: Cast) -> None:
    """Send a missile that keeps a machine or a psionic unit from attacking, casting and hiding."""
    if MARKED in world.catalog.buff_of_name:
        buffs.apply(world, cast.target, MARKED, source=cast.slot)
    projectiles.launch(world, cast, MECHANICS.matrix_speed_n)


def _apply_matrix(world: World, missile: AreaEffect, target: int) -> None:
    carrier = world.unit_type(target).name == "Carrier" and MATRIX[1] in world.catalog.buff_of_name
    loops = number(world.catalog.ability(missile.ability), "duration_loops")
    source = world.slot_of(missile.source)
    buffs.apply(world, target, MATRIX[carrier], source=source, owner=missile.owner, loops=loops)
    buffs.remove(world, target, "MedivacSpeedBoost")


# anti-armor missile ---------------------------------------------------------------------------------------------------

SEEN_COMING: Final = "RavenShredderMissileTint"
SHREDS: Final = (
    "RavenShredderMissileArmorReduction",
    "RavenShredderMissileArmorReductionUIAdd",
    "RavenShredderMissileArmorReductionUISubtruct",
)
RESEARCHED_RADIUS: Final = ("effect", "RavenShredderMissileImpactSearchArea", "AreaArray[0].Radius")


def _send_shredder(world: World, cast: Cast) -> None:
    """Send a missile that chases its target and weakens the armor of all units around it, friends as well."""
    missile = projectiles.launch(world, cast, MECHANICS.shredder_speed_n)
    missile.rule = "shredder"


def _chase(world: World, missile: AreaEffect) -> None:
    """Fly on, visible to the target; a missile that chased too far for too long gives up."""
    ability = world.catalog.ability(missile.ability)
    target = world.slot_of(missile.target)
    spent = world.loop == missile.begun + number(ability, "patience_loops")
    if spent and projectiles.flown(missile) >= number(ability, "patience_range"):
        projectiles.end(world, missile)
        return
    if target != NOBODY:
        buffs.apply(world, target, SEEN_COMING, owner=missile.owner)
    projectiles.fly(world, missile)


def _shred(world: World, missile: AreaEffect, _: int) -> None:
    """Weaken the armor of every unit around, friends as well, but of no structure."""
    ability = world.catalog.ability(missile.ability)
    source = world.slot_of(missile.source)
    radius = world.stats.with_upgrades(missile.owner, *RESEARCHED_RADIUS, number(ability, "radius"))
    loops = number(ability, "duration_loops")
    for slot in around(world, missile.at, radius, structures=False):
        for name in SHREDS:
            if name in world.catalog.buff_of_name:
                buffs.apply(world, slot, name, source=source, owner=missile.owner, loops=loops)


SKILLS: Final = {
    "build_auto_turret": Skill(
        _place_turret,
        refuse=_has_room,
        estimates=("An auto-turret stands and fires at once; in the game it is dropped from the Raven.",),
    ),
    "raven_scrambler_missile": Skill(_jam, refuse=_can_be_jammed, estimates=("The interference matrix' speed.",)),
    "raven_shredder_missile": Skill(_send_shredder, estimates=("The anti-armor missile's speed.",)),
}
AREA_EFFECTS: Final[dict[str, AreaEffectRule]] = {"shredder": _chase}

projectiles.ARRIVALS["raven_scrambler_missile"] = _apply_matrix
projectiles.ARRIVALS["raven_shredder_missile"] = _shred
