"""Skills of the warriors: Blink and Shadow Stride, Charge, and the Adept's Phase Shift.

The Adept's shade is a unit of its own that its player may send around; an area effect ties the two together and ends
with the Adept standing where the shade stood, or with a shade that is gone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.shared import teleport
from khala_simulator.abilities.skill import Skill, gap, number, place_of
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.combat.damage import apply_damage
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.area_effects import AreaEffect
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    from khala_simulator.abilities.skill import UnitRule
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.casts import Cast, Point
    from khala_simulator.world.world import World

CHARGE = 1819
CHARGING = "Charging"
SHIFTING = "AdeptPhaseShiftCaster"
SHADE = "AdeptPhaseShift"
STRIDE_DELAY = "DarkTemplarBlinkAttackDelay"
LEFT_BEHIND: Final = (
    "NeuralParasite", "MothershipRecalled", "MothershipRecalling", "FungalGrowth", "FungalGrowthSlowMovement",
    "GravitonBeam", "OracleStasisTrapTarget", "NexusMassRecallWarpOut", "MothershipStrategicWarpOut", "NexusRecalled",
)  # fmt: skip


# Blink ----------------------------------------------------------------------------------------------------------------


def _landing(world: World, cast: Cast) -> Point | None:
    """Return where a blink ends: the visible free place within its range that is nearest to its aim."""
    reach = number(cast, "distance")
    aim = teleport.within(world, cast.slot, place_of(world, cast), reach)
    return teleport.spot_near(world, cast.slot, aim, reach=reach, seen_by=int(world.owner[cast.slot]))


def _blink(world: World, cast: Cast) -> None:
    """Teleport at once to a visible place within range."""
    point = _landing(world, cast)
    if point is not None:
        teleport.turn(world, cast.slot, point)
        teleport.to(world, cast.slot, point)


def _stride(world: World, cast: Cast) -> None:
    """Teleport at once to a visible place; since 5.0.13 the unit can't attack for a second afterwards."""
    _blink(world, cast)
    if STRIDE_DELAY in world.catalog.buff_of_name:
        buffs.apply(world, cast.slot, STRIDE_DELAY, source=cast.slot)


def _cant_blink(world: World, cast: Cast) -> ActionResult:
    if buffs.has(world, cast.slot, "FungalGrowth"):
        return ActionResult.YOU_CANT_ISSUE_COMMANDS_TO_THAT_UNIT
    return ActionResult.CANT_FIND_TELEPORT_LOCATION if _landing(world, cast) is None else ActionResult.SUCCESS


# Charge ---------------------------------------------------------------------------------------------------------------


def _prey(world: World, slot: int, ability: Ability) -> int:
    """Return the unit that a Zealot with autocast charges: its target, if near enough and not adjacent."""
    target = int(world.target[slot])
    if target == NOBODY or not world.can_attack[slot] or world.holds[slot]:
        return NOBODY
    away = gap(world, slot, target)
    near = number(ability, "min_range") < away < number(ability, "max_range")
    return target if near else NOBODY


def _charge(world: World, cast: Cast) -> None:
    """Run at a unit, and deal extra damage with the first blow where the version has that."""
    if world.target[cast.slot] != cast.target:
        commands.attack_unit(world, [cast.slot], world.tag_of(cast.target))
    buffs.apply(world, cast.slot, CHARGING, source=cast.slot)


def _cant_charge(world: World, cast: Cast) -> ActionResult:
    slot, target = cast.slot, cast.target
    if target == NOBODY or not commands.can_reach(world, slot, target):
        return ActionResult.CANT_TARGET_THAT_UNIT
    away = gap(world, slot, target)
    if away >= number(cast, "max_range"):
        return ActionResult.TARGET_IS_OUT_OF_RANGE
    return ActionResult.TARGET_IS_TOO_CLOSE if away <= number(cast, "min_range") else ActionResult.SUCCESS


def _strike_home(world: World, slots: list[int]) -> None:
    """End the charges whose Zealots begin to strike, with the blow of the impact."""
    rows = world.buffs.rows
    row = world.catalog.buff(CHARGING).row
    for slot in rows["slot"][rows["buff"] == row].tolist():
        if slot in slots and world.in_reach[slot] and world.cooldown[slot] <= 0.0:
            buffs.remove(world, slot, CHARGING)
            _impact(world, slot)


def _impact(world: World, slot: int) -> None:
    damage = number(world.catalog.ability(CHARGE), "damage")
    factor = float(world.dealt_factor[slot])
    apply_damage(world, slot, int(world.owner[slot]), int(world.target[slot]), damage * factor)


# Phase Shift ----------------------------------------------------------------------------------------------------------


def _phase_shift(world: World, cast: Cast) -> None:
    """Send out a shade, and stand where it is when its time is over."""
    slot = cast.slot
    x, y = world.pos[slot].tolist()
    lasts = number(cast, "duration_loops")
    shade = lifecycle.spawn(
        world, world.catalog.unit(str(cast.ability.numbers["unit"])), int(world.owner[slot]), (x, y)
    )
    world.heading[shade] = world.heading[slot]
    world.life[shade], world.shields[shade] = world.life[slot], world.shields[slot]
    buffs.apply(world, slot, SHIFTING, source=slot)
    buffs.apply(world, shade, SHADE, source=slot)
    commands.move(world, [shade], place_of(world, cast))
    world.area_effects.append(
        AreaEffect(
            "phase_shift",
            int(world.owner[slot]),
            [(x, y)],
            0.0,
            world.loop,
            world.loop + lasts,
            due=world.loop + 1,
            source=world.tag_of(slot),
            target=world.tag_of(shade),
        )
    )


def _shift(world: World, area: AreaEffect) -> None:
    """Send the Adept to its shade when the time has come; end the shade when the Adept is dead or has cancelled."""
    adept, shade = world.slot_of(area.source), world.slot_of(area.target)
    held = adept != NOBODY and buffs.has(world, adept, SHIFTING) and world.carrier[adept] == NOBODY
    if shade == NOBODY or not held:
        area.end = world.loop
        if shade != NOBODY:
            lifecycle.remove(world, shade)
        if adept != NOBODY:
            buffs.remove(world, adept, SHIFTING)
    elif world.loop >= area.end:
        _arrive(world, adept, shade)


def _arrive(world: World, adept: int, shade: int) -> None:
    x, y = world.pos[shade].tolist()
    orders = world.orders_of(shade)
    heading = world.heading[shade].copy()
    lifecycle.remove(world, shade)
    for name in (SHIFTING, *LEFT_BEHIND):
        buffs.remove(world, adept, name)
    teleport.to(world, adept, teleport.spot_near(world, adept, (x, y)) or (x, y))
    world.heading[adept] = heading
    world.queue[adept] = orders[1:]
    commands.begin(world, adept, orders[0] if orders else None)


def _cancel_shift(world: World, cast: Cast) -> None:
    """Cancel the shift; the Adept or its shade may take the order."""
    tag = world.tag_of(cast.slot)
    for area in world.area_effects:
        if area.rule == "phase_shift" and tag in (area.source, area.target):
            adept = world.slot_of(area.source)
            if adept != NOBODY:
                buffs.remove(world, adept, SHIFTING)


SKILLS: Final = {
    "blink": Skill(
        _blink,
        refuse=_cant_blink,
        estimates=("Where its aim is not free a blink ends at the nearest free place in sight.",),
    ),
    "dark_templar_blink": Skill(_stride, refuse=_cant_blink),
    "charge": Skill(
        _charge,
        refuse=_cant_charge,
        pick=_prey,
        estimates=("An order to charge a unit farther away than 4 is refused.",),
    ),
    "adept_phase_shift": Skill(
        _phase_shift, estimates=("The shade shows the Adept's life and shields of the moment at which it came.",)
    ),
    "cancel_phase_shift": Skill(_cancel_shift),
}
AREA_EFFECTS: Final = {"phase_shift": _shift}
PASSIVES: Final[dict[str, UnitRule]] = {"Zealot": _strike_home}
OF_BUFFS: Final = frozenset(PASSIVES)
