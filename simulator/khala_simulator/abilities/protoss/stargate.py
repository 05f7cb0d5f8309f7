"""Skills of the flyers: Graviton Beam, the Oracle's Pulsar Beam, Revelation and Stasis Trap, Prismatic Alignment.

Carriers stand in ``carrier``, the Mothership in ``mothership``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.shared import teleport
from khala_simulator.abilities.skill import Skill, around, foes, number, place_of
from khala_simulator.combat import buffs, lifecycle, targets
from khala_simulator.combat.traits import refresh
from khala_simulator.movement import placement
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.area_effects import AreaEffect
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    import numpy as np

    from khala_simulator.abilities.skill import BuffRule, UnitRule
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Cast, Point
    from khala_simulator.world.world import World

LIFT = "GravitonBeam"
LIFT_HEIGHT = "GravitonBeamHeight"
LIFTER: Final = ("DisablePhoenixWeapons", "DisableEnergyRegen")
PULSAR = "OracleWeapon"
LEAST_ENERGY = 0.1  # OracleHasEnergy: with less the beam goes out
REVELATION = "OracleRevelation"
PRISM = "VoidRaySwarmDamageBoost"
STASIS = "OracleStasisTrapTarget"
TRAP = "OracleStasisTrap"
TRAP_LIFE = "StasisWardTimedLife"
TRAP_ABILITY = 2505
SPARED_BY_TRAP: Final = frozenset(
    {"Larva", "Egg", "BanelingCocoon", "RavagerCocoon", "LurkerMPEgg", "InfestedTerransEgg"}
)
RECALLED: Final = ("NexusMassRecallWarpOut", "MothershipStrategicWarpOut", "MothershipRecalling", "NexusRecalled")


# Graviton Beam --------------------------------------------------------------------------------------------------------


def _lift(world: World, cast: Cast) -> None:
    """Lift a unit off the ground, where it can do nothing, for as long as the beam holds."""
    for name in LIFTER:
        buffs.apply(world, cast.slot, name, source=cast.slot)
    _unearth(world, cast.target)
    buffs.apply(world, cast.target, LIFT_HEIGHT, source=cast.slot)
    buffs.apply(world, cast.target, LIFT, source=cast.slot)
    targets.disengage(world, cast.target)
    targets.disengage(world, cast.slot)
    _retarget(world, cast.target)


def _unearth(world: World, slot: int) -> None:
    """Turn a burrowed unit into its unburrowed type."""
    unit = world.unit_type(slot)
    above = unit.name.replace("Burrowed", "")
    if unit.burrowed and above in world.catalog.row_of_name:
        lifecycle.become(world, slot, world.catalog.unit(above))


def _keep_lifted(world: World, cast: Cast) -> bool:
    """Hold the beam until its time is over, or the target is gone, out of sight, or can't be touched any more."""
    target = int(world.order_target[cast.slot])
    if target == NOBODY or not world.targetable[target] or not world.can_cast[cast.slot]:
        return False
    if world.loop - cast.begun >= number(cast, "duration_loops"):
        return False
    buffs.apply(world, target, LIFT, source=cast.slot)
    return True


def _lifter_done(world: World, cast: Cast) -> None:
    for name in LIFTER:
        buffs.remove(world, cast.slot, name)


def _put_down(world: World, slot: int, _: np.void) -> None:
    """Put down a unit that is no longer held, beside any unit that stands there."""
    buffs.remove(world, slot, LIFT_HEIGHT)
    x, y = world.pos[slot].tolist()
    teleport.to(world, slot, teleport.spot_near(world, slot, (x, y)) or (x, y))
    _retarget(world, slot)


def _retarget(world: World, slot: int) -> None:
    """Switch the attackers of a unit that changed its plane to the weapon that fits now, or end their fight."""
    for fighter in (world.target[: world.top] == slot).nonzero()[0].tolist():
        if not targets.engage(world, fighter, slot):
            targets.disengage(world, fighter)


def _cant_lift(world: World, cast: Cast) -> ActionResult:
    return ActionResult.ALREADY_TARGETED if buffs.has(world, cast.target, "Yoink") else ActionResult.SUCCESS


def _let_go(world: World, cast: Cast) -> None:
    """End the beam."""
    commands.begin_next(world, cast.slot)


def _cant_let_go(world: World, cast: Cast) -> ActionResult:
    return ActionResult.SUCCESS if cast.slot in world.channelling else ActionResult.CANT_FIND_CANCEL_ORDER


# Oracle ---------------------------------------------------------------------------------------------------------------


def _pulsar_on(world: World, cast: Cast) -> None:
    """Switch on the beam, which spends energy until it is switched off or there is none."""
    buffs.apply(world, cast.slot, PULSAR, source=cast.slot)
    world.scan_now = True


def _pulsar_off(world: World, cast: Cast) -> None:
    """Switch off the beam."""
    _disarm(world, cast.slot)


def _disarm(world: World, slot: int) -> None:
    buffs.remove(world, slot, PULSAR)
    targets.disengage(world, slot)


def _pulses(world: World, cast: Cast) -> ActionResult:
    return ActionResult.ERROR if buffs.has(world, cast.slot, PULSAR) else ActionResult.SUCCESS


def _does_not_pulse(world: World, cast: Cast) -> ActionResult:
    return ActionResult.SUCCESS if buffs.has(world, cast.slot, PULSAR) else ActionResult.ERROR


def _mind_energy(world: World, slots: list[int]) -> None:
    """Switch off the beams of Oracles without energy."""
    for slot in slots:
        if world.energy[slot] < LEAST_ENERGY and buffs.has(world, slot, PULSAR):
            _disarm(world, slot)


def _reveal(world: World, cast: Cast) -> None:
    """Show the owner the enemies around a place for a while, cloaked ones too."""
    owner = int(world.owner[cast.slot])
    near = around(world, place_of(world, cast), number(cast, "radius"))
    for slot in foes(world, near, owner):
        buffs.apply(world, slot, REVELATION, source=cast.slot, loops=number(cast, "duration_loops"))
    world.looked_at = -1


def _set_trap(world: World, cast: Cast) -> None:
    """Begin a trap, which finishes itself; its energy is paid now."""
    point = _trap_place(world, cast)
    trap = lifecycle.spawn(
        world, world.catalog.unit(str(cast.ability.numbers["unit"])), int(world.owner[cast.slot]), point
    )
    world.build_progress[trap] = 0.0
    refresh(world, trap)
    end = world.loop + cast.ability.loops
    world.area_effects.append(
        AreaEffect(
            "trap_forms", int(world.owner[trap]), [point], 0.0, world.loop, end, due=end, source=world.tag_of(trap)
        )
    )


def _trap_place(world: World, cast: Cast) -> Point:
    unit = world.catalog.unit(str(cast.ability.numbers["unit"]))
    return placement.snap(place_of(world, cast), world.catalog.footprints[unit.footprint].size)


def _cant_set_trap(world: World, cast: Cast) -> ActionResult:
    x, y = _trap_place(world, cast)
    height, width = world.ground.walk.shape
    inside = 0 <= x < width and 0 <= y < height
    free = inside and bool(world.ground.walk[int(y), int(x)] and world.map.terrain.build[int(y), int(x)])
    return ActionResult.SUCCESS if free else ActionResult.CANT_BUILD_LOCATION_INVALID


def _trap_done(world: World, area: AreaEffect) -> None:
    trap = world.slot_of(area.source)
    if trap != NOBODY:
        world.build_progress[trap] = 1.0
        buffs.apply(world, trap, TRAP_LIFE)
        teleport.live_until(world, trap, world.loop + world.catalog.buff(TRAP_LIFE).loops)
        refresh(world, trap)


def _intruder(world: World, slot: int, ability: Ability) -> int:
    """Return the trap itself if an enemy on the ground within reach sets it off, else NOBODY."""
    x, y = world.pos[slot].tolist()
    reach = ability.autocast_range + float(world.radius[slot])
    near = _catchable(world, slot, around(world, (x, y), reach, plane="ground", structures=False))
    return slot if near else NOBODY


def _catchable(world: World, trap: int, slots: list[int]) -> list[int]:
    return [
        slot
        for slot in foes(world, slots, int(world.owner[trap]))
        if world.unit_type(slot).name not in SPARED_BY_TRAP
        and not any(buffs.has(world, slot, name) for name in RECALLED)
    ]


def _cant_spring(world: World, cast: Cast) -> ActionResult:
    sprung = buffs.has(world, cast.slot, "OracleStasisTrapCaster")
    return ActionResult.COOLDOWN if sprung else ActionResult.SUCCESS


def _spring(world: World, cast: Cast) -> None:
    """Show the trap, catch every unit around it after a moment, and remove it a little later."""
    slot = cast.slot
    x, y = world.pos[slot].tolist()
    delay = number(cast, "delay_loops")
    buffs.apply(world, slot, "OracleStasisTrapCaster", source=slot)
    teleport.live_until(world, slot, world.loop + number(cast, "gone_loops"))
    owner = int(world.owner[slot])
    tag = world.tag_of(slot)
    spot = AreaEffect(
        "trap_springs", owner, [(x, y)], number(cast, "radius"), world.loop, world.loop + delay, source=tag
    )
    spot.due = spot.end
    spot.period = delay
    sight_end = world.loop + number(cast, "sight_loops")
    seen = AreaEffect("sight", owner, [(x, y)], number(cast, "sight_radius"), world.loop, sight_end)
    seen.due = sight_end
    seen.sights = number(cast, "sight_radius")
    world.area_effects += [spot, seen]


def _catch(world: World, area: AreaEffect) -> None:
    trap = world.slot_of(area.source)
    if trap == NOBODY:
        return
    near = around(world, area.at, area.radius, plane="ground", structures=False)
    for slot in _catchable(world, trap, near):
        targets.disengage(world, slot)
        buffs.apply(world, slot, STASIS, source=trap, owner=area.owner)


# Void Ray -------------------------------------------------------------------------------------------------------------


def _align(world: World, cast: Cast) -> None:
    """Deal more damage to armored units for a while, and be slower."""
    buffs.apply(world, cast.slot, PRISM, source=cast.slot, loops=number(cast, "duration_loops"))


def _unalign(world: World, cast: Cast) -> None:
    """End the alignment."""
    buffs.remove(world, cast.slot, PRISM)


SKILLS: Final = {
    "graviton_beam": Skill(_lift, refuse=_cant_lift, hold=_keep_lifted, end=_lifter_done),
    "cancel_graviton_beam": Skill(_let_go, refuse=_cant_let_go),
    "pulsar_beam_on": Skill(_pulsar_on, refuse=_pulses),
    "pulsar_beam_off": Skill(_pulsar_off, refuse=_does_not_pulse),
    "revelation": Skill(_reveal, estimates=("Revelation touches a unit whose edge is within its radius.",)),
    "stasis_trap": Skill(_set_trap, refuse=_cant_set_trap),
    "activate_stasis_trap": Skill(_spring, refuse=_cant_spring, pick=_intruder),
    "prismatic_alignment": Skill(_align),
    "cancel_prismatic_alignment": Skill(_unalign),
}
AREA_EFFECTS: Final = {"trap_forms": _trap_done, "trap_springs": _catch, "sight": lambda _, __: None}
PASSIVES: Final[dict[str, UnitRule]] = {"Oracle": _mind_energy}
ENDS: Final[dict[str, BuffRule]] = {LIFT: _put_down}
