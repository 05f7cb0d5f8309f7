"""Skills over large areas: Mass Recall of the Mothership and of the Nexus, Time Warp, and the cloaking field.

A recall marks the units it takes; each of them leaves when its mark runs out. Time Warp is an area effect that applies
a slowing buff to enemies in every loop; the cloaking field does the same with its own buff for friends.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from khala_simulator.abilities import commands
from khala_simulator.abilities.shared import teleport
from khala_simulator.abilities.skill import Skill, around, foes, friends, lay, number, place_of
from khala_simulator.combat import buffs
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.columns import NOBODY

if TYPE_CHECKING:
    import numpy as np

    from khala_simulator.abilities.skill import BuffRule, UnitRule
    from khala_simulator.tables.abilities import Ability
    from khala_simulator.world.area_effects import AreaEffect
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

GROWING_EFFECT, WARP_EFFECT = 3, 4
WARPED = "TemporalField"
CLOAK_FIELD = "CloakField"
CLOAKED = "CloakFieldEffect"
CLOAK_RADIUS = 5.0  # the catalog's CloakingFieldSearch, the same in both versions
NEVER_CLOAKED: Final = frozenset({"Mothership", "MothershipCore", "DisruptorPhased"})
RECALLED = "NexusRecalled"
STAYS_BEHIND: Final = frozenset({"Larva", "Egg", "Interceptor", "AdeptPhaseShift", "DisruptorPhased"})
LEAVING: Final = ("NexusMassRecallWarpOut", "MothershipStrategicWarpOut")
SCRAMBLED = "RavenScramblerMissile"


# recalls --------------------------------------------------------------------------------------------------------------


def _taken(world: World, cast: Cast) -> list[int]:
    """Return the units that a recall would take: the owner's in the circle, except its caster and bound ones."""
    near = around(world, place_of(world, cast), number(cast, "radius"), structures=False)
    return [
        slot
        for slot in friends(world, near, int(world.owner[cast.slot]))
        if slot != cast.slot
        and world.unit_type(slot).name not in STAYS_BEHIND
        and world.build_progress[slot] >= 1.0
        and not any(buffs.has(world, slot, name) for name in (*LEAVING, "Yoink"))
    ]


def _recall(world: World, cast: Cast) -> None:
    """Mark the units; an area effect brings them to where the caster is now when the marks run out."""
    name = str(cast.ability.numbers["buff"])
    taken = _taken(world, cast)
    for slot in taken:
        buffs.apply(world, slot, name, source=cast.slot)
    x, y = world.pos[cast.slot].tolist()
    lasts = world.catalog.buff(name).loops
    lay(world, cast, "recall", end=world.loop + lasts, due=world.loop + 1).points.append((x, y))


def _bring(world: World, area: AreaEffect) -> None:
    """Teleport the marked units at the end; if the caster is gone they stay and are free."""
    caster = world.slot_of(area.source)
    lost = caster == NOBODY or buffs.has(world, caster, SCRAMBLED)
    if not lost and world.loop < area.end:
        return
    name = str(world.catalog.ability(area.ability).numbers["buff"])
    for slot in _bearers(world, name, area):
        buffs.remove(world, slot, name)
        if not lost:
            _arrive(world, slot, area)
    area.end = world.loop


def _bearers(world: World, name: str, area: AreaEffect) -> list[int]:
    """Return the units that bear a recall's mark."""
    rows = world.buffs.rows
    mine = (rows["buff"] == world.catalog.buff(name).row) & (rows["begun"] == area.begun)
    mine &= (rows["source"] == world.slot_of(area.source)) | (rows["source"] == NOBODY)
    slots: list[int] = rows["slot"][mine].tolist()
    return slots


def _arrive(world: World, slot: int, area: AreaEffect) -> None:
    """Place the unit at its old offset from the middle of the recall, or as near to there as it fits."""
    (from_x, from_y), (to_x, to_y) = area.points
    x, y = world.pos[slot].tolist()
    wanted = to_x + x - from_x, to_y + y - from_y
    world.queue[slot] = []
    commands.begin(world, slot, None)
    teleport.to(world, slot, teleport.spot_near(world, slot, wanted) or wanted)
    commands.begin(world, slot, None)
    buffs.apply(world, slot, RECALLED)


def _nobody_to_recall(world: World, cast: Cast) -> ActionResult:
    return ActionResult.SUCCESS if _taken(world, cast) else ActionResult.CANT_TARGET_THAT_UNIT


# Time Warp ------------------------------------------------------------------------------------------------------------


def _time_warp(world: World, cast: Cast) -> None:
    """Slow the enemies around a place, as soon as the bubble has grown."""
    grown = world.loop + number(cast, "growing_loops")
    lay(world, cast, "time_warp", end=grown + number(cast, "duration_loops"), due=grown, effect=GROWING_EFFECT)


def _slow(world: World, area: AreaEffect) -> None:
    area.effect = WARP_EFFECT
    plane = str(world.catalog.ability(area.ability).numbers["plane"])
    for slot in foes(world, around(world, area.at, area.radius, plane=plane), area.owner):
        buffs.apply(world, slot, WARPED, source=world.slot_of(area.source), owner=area.owner)


# the cloaking field ---------------------------------------------------------------------------------------------------


def _always_cloaks(world: World, slots: list[int]) -> None:
    """Give every Mothership the field from the beginning where it is no ability (4.10)."""
    if world.catalog.buff(CLOAK_FIELD).loops:
        return
    for slot in slots:
        if not world.hallucination[slot] and not buffs.has(world, slot, CLOAK_FIELD):
            buffs.apply(world, slot, CLOAK_FIELD, source=slot)


def _cloak_around(world: World, slot: int, _: np.void) -> None:
    """Cloak the owner's units and structures near a Mothership for a moment."""
    if world.carrier[slot] != NOBODY or buffs.has(world, slot, SCRAMBLED):
        return
    x, y = world.pos[slot].tolist()
    near = around(world, (x, y), CLOAK_RADIUS + float(world.radius[slot]))
    for other in friends(world, near, int(world.owner[slot])):
        if other != slot and world.unit_type(other).name not in NEVER_CLOAKED:
            buffs.apply(world, other, CLOAKED, source=slot)


def _cloak(world: World, cast: Cast) -> None:
    """Cloak the owner's units and structures around the Mothership for a while."""
    buffs.apply(world, cast.slot, CLOAK_FIELD, source=cast.slot, loops=number(cast, "duration_loops"))


# what a Nexus does for structures -------------------------------------------------------------------------------------


def _chrono_boost(world: World, cast: Cast) -> None:
    """Make a structure work faster for a while."""
    buffs.apply(world, cast.target, str(cast.ability.numbers["buff"]), source=cast.slot)


def _cant_boost(world: World, cast: Cast) -> ActionResult:
    if world.build_progress[cast.target] < 1.0:
        return ActionResult.CANT_TARGET_UNDER_CONSTRUCTION_UNITS
    card = world.catalog.abilities_of(int(world.type[cast.target]))
    return ActionResult.SUCCESS if any(map(_makes_something, card)) else ActionResult.CANT_TARGET_THAT_UNIT


def _makes_something(ability: Ability) -> bool:
    return ability.effect in ("train", "research", "warp_in") or bool(ability.upgrade)


SKILLS: Final = {
    "recall": Skill(
        _recall,
        refuse=_nobody_to_recall,
        estimates=(
            "The destination of a recall is where its caster stood when it began.",
            "Recalled units keep their places to each other as far as there is room.",
        ),
    ),
    "time_warp": Skill(_time_warp),
    "mothership_cloak": Skill(_cloak),
    "chrono_boost": Skill(_chrono_boost, refuse=_cant_boost),
}
AREA_EFFECTS: Final = {"recall": _bring, "time_warp": _slow}
TICKS: Final[dict[str, BuffRule]] = {CLOAK_FIELD: _cloak_around}
PASSIVES: Final[dict[str, UnitRule]] = {"Mothership": _always_cloaks}
