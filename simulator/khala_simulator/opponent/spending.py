"""Spending: what a player builds, trains and researches, in the order in which it matters.

What can't be paid yet is put aside, so that what comes later does not eat it up. While the army is too small for what
is known of the enemy, the army comes first.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.economy import production
from khala_simulator.opponent import bases, composition, economy, products, sites
from khala_simulator.opponent.levels import FASTER_LOOPS
from khala_simulator.opponent.products import MakeOutcome

if TYPE_CHECKING:
    from khala_simulator.opponent.economy import Staff
    from khala_simulator.opponent.enemy import Enemy
    from khala_simulator.opponent.side import OwnSide

MOST_GUARD: Final = 60.0
"""No larger army comes before upgrades and structures."""
QUEEN: Final = 1.5
"""What a Queen counts as army supply."""
PATIENCE_S: Final = 70.0
"""A step of the opening that is impossible for so long is skipped."""
WAITED: Final = 300.0
"""With so many minerals a step of the opening, except a town hall, does not wait for its supply: the workers of weak
levels come late."""
RICH: Final = 450.0
"""With so many minerals unspent there are too few producers."""
PLENTY_OF_GAS: Final = 150.0
IDLE_GAS: Final = 150.0
"""With so much vespene upgrades come before an army that is too small: what it lacks is minerals."""
PRODUCERS_PER_BASE: Final = 4
FULL_SHARE: Final = 0.8
"""A side expands when its bases have this share of the workers that they want."""
ORBITAL: Final = "OrbitalCommand"
SPARSE: Final = 4
"""A base that wants so few workers on its minerals is mined out."""
ADDONS: Final = ("TechLab", "Reactor")
LEVELS: Final = ("Level1", "Level2", "Level3")


def spend(side: OwnSide, enemy: Enemy, staff: Staff) -> None:
    """Spend the money of this thought."""
    economy.keep_supply_ahead(side)
    make_addons(side)
    danger = in_danger(side, enemy)
    if danger:
        if side.mind.threat is None:
            _before_the_army(side, staff)
        train_army(side)
    change_halls(side)
    if _opening_and_workers(side, enemy, staff):
        if not danger:
            expand(side, enemy, staff)
        build_structures(side)
        make_units(side)
        research(side)
    if not danger:
        train_army(side)


def _before_the_army(side: OwnSide, staff: Staff) -> None:
    """Spend on the economy even while the army is too small, as long as no enemy attacks."""
    if side.owner.vespene >= IDLE_GAS:
        research(side)
    if not side.build.saves:
        economy.train_workers(side, staff)


def _opening_and_workers(side: OwnSide, enemy: Enemy, staff: Staff) -> bool:
    """Follow the opening and make workers, whichever the build pays first; return True once the opening is over."""
    if not side.build.saves:
        economy.train_workers(side, staff)
    over = follow_opening(side, enemy)
    if side.build.saves:
        economy.train_workers(side, staff)
    return over


def in_danger(side: OwnSide, enemy: Enemy) -> bool:
    """Return whether the army comes before everything else."""
    own = side.army_supply + _coming(side) + QUEEN * len(side.of_type("Queen"))
    expected = min(MOST_GUARD, side.build.guard.supply(side.clock_s)) * side.level.production
    known = enemy.army_supply() if "adapt" in side.level.skills or side.level.vision else 0.0
    attacked = side.mind.threat is not None and side.mind.alarm >= 0
    return own < max(expected, 0.8 * known) or (attacked and own < 1.5 * known + 4.0)


def _coming(side: OwnSide) -> float:
    units = side.world.catalog
    return sum(units.unit(n).supply * k for n, k in side.underway.items() if n in units.row_of_name
               and units.unit(n).army)  # fmt: skip


# structures -----------------------------------------------------------------------------------------------------------


def follow_opening(side: OwnSide, enemy: Enemy) -> bool:
    """Make the next step of the opening if its time has come; return True once the opening is over."""
    mind, opening = side.mind, side.build.opening
    if mind.step >= len(opening):
        return True
    step = opening[mind.step]
    hall = step.what == side.race.hall
    if side.world.loop < mind.step_since + side.level.step_s * FASTER_LOOPS:
        return False
    if side.used < step.supply and (hall or side.owner.minerals < WAITED):
        return False
    near = bases.next_place(side, enemy) if hall else None
    outcome = products.make(side, step.what, near=near)
    patient = side.world.loop - mind.step_since < PATIENCE_S * FASTER_LOOPS * side.level.tempo
    if outcome is MakeOutcome.DONE or (outcome is MakeOutcome.BLOCKED and not patient):
        mind.step, mind.step_since = mind.step + 1, side.world.loop
    return mind.step >= len(opening)


def change_halls(side: OwnSide) -> None:
    """Change the kind of a town hall before it trains the next worker, once the build wants that."""
    if side.count(ORBITAL) < side.stage.structures.get(ORBITAL, 0):
        products.make(side, ORBITAL)


def make_addons(side: OwnSide) -> None:
    """Make the add-ons that can be paid; keep a producer idle for one that has none idle: busy ones can't build it."""
    for name, wanted in side.stage.structures.items():
        missing = name.endswith(ADDONS) and side.count(name) < _scale(side, wanted)
        paid = missing and side.purse.affords(products.ways(side.world.catalog, name)[0])
        if paid and products.make(side, name) is not MakeOutcome.DONE:
            products.keep_for(side, name)


def expand(side: OwnSide, enemy: Enemy, staff: Staff) -> None:
    """Take another base when the build wants one, and the others are full or the money is too much for them."""
    hall = side.race.hall
    mined_out = sum(ideal <= SPARSE for _, ideal in staff.halls.values())
    have = len(side.halls) - mined_out + len(side.begun.get(hall, ())) + side.ordered[hall]
    short_of_larvae = hall == side.race.producer and not side.of_type("Larva")
    rich = side.owner.minerals > (RICH if short_of_larvae else 2 * RICH)
    wanted = min(side.level.bases, max(side.stage.bases, have + 1 if rich else 0))
    full = len(side.workers) >= FULL_SHARE * staff.places
    if have < wanted and (full or rich):
        place = bases.next_place(side, enemy)
        if place is None and rich and hall == side.race.producer:
            place = sites.beside(side, side.world.catalog.unit(hall))
        if place is not None:
            products.make(side, hall, near=place)


def build_structures(side: OwnSide) -> None:
    """Make the first structure that is missing; gas first."""
    gas = min(side.stage.gas, 2 * len(side.halls))
    short = side.owner.vespene < PLENTY_OF_GAS
    if short and side.count(side.race.gas) < gas and len(side.workers) >= 14 + 3 * side.count(side.race.gas):
        products.make(side, side.race.gas)
    for name, wanted in side.stage.structures.items():
        if side.count(name) < _scale(side, wanted) and _make_another(side, name):
            return
    _more_producers(side)


def _make_another(side: OwnSide, name: str) -> bool:
    """Make one more structure, or what it requires; return False when others need not wait for it."""
    first = products.lacking(side, name)
    return products.make(side, first or name) is not MakeOutcome.BLOCKED


def _scale(side: OwnSide, wanted: int) -> int:
    """Return how many of a structure a level wants; of each kind at least one."""
    return max(1, math.ceil(wanted * min(1.0, side.level.production))) if wanted > 1 else wanted


def _more_producers(side: OwnSide) -> None:
    """Build more producers when the money is not spent."""
    name = side.race.producer
    most = max(1, math.floor(PRODUCERS_PER_BASE * side.level.production * max(len(side.halls), 1)))
    if side.owner.minerals < RICH or name == side.race.hall or side.count(name) >= most:
        return
    busy = all(len(side.world.jobs.get(s, ())) > 0 or side.world.unit_type(s).name == "WarpGate"
               for s in side.kind(name))  # fmt: skip
    if busy:
        products.make(side, name)


def research(side: OwnSide) -> None:
    """Begin the first upgrade that is missing, as far as the level goes."""
    known = {side.world.catalog.upgrade(number).name for number in side.owner.upgrades}
    for name in side.stage.research:
        tier = next((i + 1 for i, suffix in enumerate(LEVELS) if name.endswith(suffix)), 0)
        if name in known or side.underway[name] or tier > side.level.upgrades or not side.level.upgrades:
            continue
        if products.make(side, name) is MakeOutcome.SHORT:
            return


# units ----------------------------------------------------------------------------------------------------------------


def make_units(side: OwnSide) -> None:
    """Make single units that the build wants, such as Queens and detectors; Queens as many as town halls."""
    for name, wanted in side.stage.units.items():
        most = min(wanted, len(side.halls) + 1) if name == "Queen" else wanted
        if side.count(name) < most and side.level.production > 0.35:
            products.make(side, name)


def train_army(side: OwnSide) -> None:
    """Make the units that the army lacks most, as many as the level, producers and money allow."""
    shares = composition.shares(side)
    for _ in range(_free_producers(side)):
        if side.world.loop < side.mind.next_army or not _train_first_possible(side, composition.by_need(side, shares)):
            return


def _train_first_possible(side: OwnSide, names: list[str]) -> bool:
    """Make the first unit that is possible; return whether it is paid."""
    for name in names:
        outcome = products.make(side, name) if _worth_waiting(side, name) else MakeOutcome.BLOCKED
        if outcome is MakeOutcome.DONE:
            ability = products.ways(side.world.catalog, name)[0]
            pace = side.level.army_s * economy.A_HALL / max(1, len(side.workers))
            side.mind.next_army = side.after(pace * ability.supply)
        if outcome is not MakeOutcome.BLOCKED:
            return outcome is MakeOutcome.DONE
    return False


def _worth_waiting(side: OwnSide, name: str) -> bool:
    """Return whether a unit can be paid, or lacks only minerals: a unit that lacks vespene does not stop the others."""
    vespene = products.ways(side.world.catalog, name)[0].vespene
    return not vespene or vespene <= side.purse.vespene


def _free_producers(side: OwnSide) -> int:
    world = side.world
    larvae = len(side.of_type("Larva"))
    slots = [s for name in ("Gateway", "Barracks", "Factory", "Starport", "RoboticsFacility", "Stargate")
             for s in side.kind(name)]  # fmt: skip
    free = sum(max(0, production.parallel(world, s) - len(world.jobs.get(s, ()))) for s in slots)
    return int(np.clip(free + larvae, 0, 12))
