"""Terran structures: fires, salvage, radar, and depots that units walk over.

Production and construction decide what they make and how they are built; flying ones are in ``landing``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.abilities.skill import Skill, number
from khala_simulator.combat import buffs, lifecycle
from khala_simulator.tables.action_result import ActionResult
from khala_simulator.world.columns import NOBODY
from khala_simulator.world.world import Death

if TYPE_CHECKING:
    from khala_simulator.abilities.skill import BuffRule, UnitRule
    from khala_simulator.world.casts import Cast
    from khala_simulator.world.world import World

# fires ----------------------------------------------------------------------------------------------------------------

BURNING: Final = "TerranBuildingBurnDown"
BURNS_BELOW: Final = 1.0 / 3.0
BURN_DAMAGE: Final = 1.0
LOOKED_AFTER: Final = 4
INFLAMMABLE: Final = (
    "CommandCenter", "CommandCenterFlying", "OrbitalCommand", "OrbitalCommandFlying", "PlanetaryFortress",
    "SupplyDepot", "SupplyDepotLowered", "Refinery", "RefineryRich", "Barracks", "BarracksFlying", "EngineeringBay",
    "MissileTurret", "Bunker", "SensorTower", "GhostAcademy", "Factory", "FactoryFlying", "Starport", "StarportFlying",
    "Armory", "FusionCore", "AutoTurret", "TechLab", "Reactor", "BarracksTechLab", "BarracksReactor", "FactoryTechLab",
    "FactoryReactor", "StarportTechLab", "StarportReactor",
)  # fmt: skip


def _catch_fire(world: World, slots: list[int]) -> None:
    """Make badly damaged finished structures burn; checked every few loops."""
    if world.loop % LOOKED_AFTER:
        return
    at = np.array(slots)
    low = world.life[at] < world.life_max[at] * BURNS_BELOW
    for slot in at[low & (world.build_progress[at] >= 1.0)].tolist():
        if not buffs.has(world, slot, BURNING):
            buffs.apply(world, slot, BURNING)


def _burn(world: World, slot: int, _: np.void) -> None:
    """Take life from a burning structure, or put the fire out when it has been repaired; no player gets the credit."""
    if world.life[slot] >= world.life_max[slot] * BURNS_BELOW:
        buffs.remove(world, slot, BURNING)
        return
    world.life[slot] = max(float(world.life[slot]) - BURN_DAMAGE, 0.0)
    if world.life[slot] <= 0.0:
        world.attacker[slot] = NOBODY


# salvage --------------------------------------------------------------------------------------------------------------

SALVAGED: Final = "SalvageShared"
NO_KILLER: Final = -1


def _salvage(world: World, cast: Cast) -> None:
    """Take the structure down, and refund three quarters of its cost when that is done."""
    buffs.apply(world, cast.slot, SALVAGED, source=cast.slot)


def _not_yet(world: World, cast: Cast) -> ActionResult:
    """Refuse a structure that has passengers, or is being taken down already."""
    inside = bool(world.passengers(cast.slot)) or buffs.has(world, cast.slot, SALVAGED)
    return ActionResult.ERROR if inside else ActionResult.SUCCESS


def _take_down(world: World, slot: int, row: np.void) -> None:
    """Give back a part of what a structure cost; it leaves the world, and no score counts it as lost."""
    owner = int(row["owner"])
    ability = next(a for a in world.catalog.abilities if a.effect == "salvage_shared_on")
    share = number(ability, "refund")
    minerals, vespene = world.unit_type(slot).cost
    world.players[owner].minerals += minerals * share
    world.players[owner].vespene += vespene * share
    world.deaths.append(Death(world.loop, world.tag_of(slot), world.unit_type(slot).id, owner, NO_KILLER))
    lifecycle.remove(world, slot)


# radar ----------------------------------------------------------------------------------------------------------------

RADAR: Final = {"SensorTower": "SensorTowerRadar"}


@dataclass(frozen=True, slots=True)
class Radar:
    """The circle in which a player learns of moving units that it does not see: whose, where, how far."""

    owner: int
    point: tuple[float, float]
    radius: float


def radars(world: World) -> list[Radar]:
    """Return every radar that works now, in the order of slots."""
    rows = {world.catalog.row_of_name[name]: world.catalog.buff(buff).radar for name, buff in RADAR.items()}
    slots = world.live[np.isin(world.type[world.live], list(rows))]
    slots = slots[world.build_progress[slots] >= 1.0]
    found = []
    for slot in slots.tolist():
        if not buffs.has(world, slot, SALVAGED):
            x, y = world.pos[slot].tolist()
            found.append(Radar(int(world.owner[slot]), (x, y), rows[int(world.type[slot])]))
    return found


SKILLS: Final = {"salvage_shared_on": Skill(_salvage, refuse=_not_yet)}
TICKS: Final[dict[str, BuffRule]] = {BURNING: _burn}
ENDS: Final[dict[str, BuffRule]] = {SALVAGED: _take_down}
PASSIVES: Final[dict[str, UnitRule]] = dict.fromkeys(INFLAMMABLE, _catch_fire)
