"""The Templars' skills: Psi Storm, Feedback and the merging of two into an Archon.

A storm searches its circle again and again and applies a buff to the units it finds; the buff does the damage. A unit
has it only once, so that storms do not add up, and it goes on for a moment after the unit has left.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.abilities import commands
from khala_simulator.abilities.skill import Skill, around, lay, number
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.combat.damage import apply_damage
from khala_simulator.combat.traits import refresh
from khala_simulator.numeric.arrays import which
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.area_effects import AreaEffect
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.orders import Order, OrderKind

if TYPE_CHECKING:
    from khala_simulator.abilities.skill import BuffRule
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

STORM_EFFECT = 1
STORM_BUFF = "PsiStorm"
STORM_ABILITY = 1036
ROUNDING = 1e-6  # of the periods, added up
MERGE_TARGET = 1767
TEMPLARS: Final = ("HighTemplar", "DarkTemplar")
SPARED_BY_FEEDBACK: Final = frozenset({"OrbitalCommand", "OrbitalCommandFlying", "Nexus", "ShieldBattery"})


# Psi Storm ------------------------------------------------------------------------------------------------------------


def _psi_storm(world: World, cast: Cast) -> None:
    """Start a storm at a place; it hurts everything in it except structures."""
    period = number(cast, "search_period_loops")
    end = world.loop + period * (number(cast, "searches") - 1) + ROUNDING
    lay(world, cast, "psi_storm", end=end, due=world.loop, effect=STORM_EFFECT, period=period)


def _search(world: World, area: AreaEffect) -> None:
    """Find the units that the storm touches, friends too; new ones take damage at once."""
    source = world.slot_of(area.source)
    for slot in around(world, area.at, area.radius, structures=False):
        fresh = not buffs.has(world, slot, STORM_BUFF)
        buffs.apply(world, slot, STORM_BUFF, source=source, owner=area.owner)
        if fresh:
            _hurt(world, slot, source, area.owner)


def _storm_tick(world: World, slot: int, row: np.void) -> None:
    _hurt(world, slot, int(row["source"]), int(row["owner"]))


def _hurt(world: World, slot: int, source: int, owner: int) -> None:
    apply_damage(world, source, owner, slot, number(world.catalog.ability(STORM_ABILITY), "damage"))


# Feedback -------------------------------------------------------------------------------------------------------------


def _feedback(world: World, cast: Cast) -> None:
    """Drain all energy of a unit and hurt it by half of that."""
    energy = float(world.energy[cast.target])
    amount = energy * number(cast, "damage_per_energy")
    world.energy[cast.target] = energy * (1.0 - number(cast, "energy_drained_fraction"))
    apply_damage(world, cast.slot, int(world.owner[cast.slot]), cast.target, amount)


def _cant_feed_back(world: World, cast: Cast) -> ActionResult:
    spared = world.unit_type(cast.target).name in SPARED_BY_FEEDBACK
    return ActionResult.CANT_TARGET_THAT_UNIT if spared else ActionResult.SUCCESS


# Archons --------------------------------------------------------------------------------------------------------------


def _pair(world: World, cast: Cast) -> None:
    """Send the unit and the nearest other one with the merge order to each other; without one nothing happens."""
    slot = cast.slot
    asked = which(world.casts[: world.top] & (world.order_ability[: world.top] == cast.ability.id))
    asked = asked[(world.owner[asked] == world.owner[slot]) & (asked != slot)]
    if not asked.size:
        return
    offset = world.pos[asked] - world.pos[slot]
    partner = int(asked[np.argmin(offset[:, 0] ** 2 + offset[:, 1] ** 2)])
    for templar, other in ((slot, partner), (partner, slot)):
        commands.begin(world, templar, Order(OrderKind.CAST, MERGE_TARGET, target=world.tag_of(other)))


def _fuse(world: World, cast: Cast) -> None:
    """Merge with another Templar beside it into an Archon, which takes its time to form."""
    owner = int(world.owner[cast.slot])
    x, y = ((world.pos[cast.slot] + world.pos[cast.target]) / 2.0).tolist()
    archon = lifecycle.spawn(world, world.catalog.unit(str(cast.ability.numbers["unit"])), owner, (x, y))
    lifecycle.remove(world, cast.slot)
    lifecycle.remove(world, cast.target)
    world.build_progress[archon] = 0.0
    refresh(world, archon)
    end = world.loop + cast.ability.loops
    world.area_effects.append(
        AreaEffect(
            "archon_merge", owner, [(x, y)], 0.0, world.loop, end, due=world.loop + 1, source=world.tag_of(archon)
        )
    )


def _form(world: World, area: AreaEffect) -> None:
    archon = world.slot_of(area.source)
    if archon == NOBODY:
        area.end = world.loop
        return
    world.build_progress[archon] = min((world.loop - area.begun) / (area.end - area.begun), 1.0)
    if world.build_progress[archon] >= 1.0:
        refresh(world, archon)
        world.orders_changed = world.scan_now = True


def _cant_merge(world: World, cast: Cast) -> ActionResult:
    fits = cast.target == NOBODY or world.unit_type(cast.target).name in TEMPLARS
    return ActionResult.SUCCESS if fits else ActionResult.CANT_TARGET_THAT_UNIT


SKILLS: Final = {
    "psi_storm": Skill(_psi_storm),
    "feedback": Skill(_feedback, refuse=_cant_feed_back),
    "merge": Skill(_pair, estimates=("If several Templars merge, each takes the nearest other one as its partner.",)),
    "merge_with": Skill(
        _fuse,
        refuse=_cant_merge,
        estimates=("An Archon in the making has full life and shields and can be attacked.",),
    ),
}
AREA_EFFECTS: Final = {"psi_storm": _search, "archon_merge": _form}
TICKS: Final[dict[str, BuffRule]] = {STORM_BUFF: _storm_tick}
