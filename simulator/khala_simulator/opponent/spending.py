"""Spending: what a player builds, trains and researches, in the order in which it matters.

What can't be paid yet is put aside, so that what comes later does not eat it up. The steps of the plan come first, then
workers, then the army up to the size that the level has at that time. What is left is not spent, as weak levels do.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.economy import production
from khala_simulator.opponent import bases, composition, economy, products
from khala_simulator.opponent.products import MakeOutcome

if TYPE_CHECKING:
    from khala_simulator.opponent.economy import Staff
    from khala_simulator.opponent.enemy import Enemy
    from khala_simulator.opponent.side import OwnSide

QUICKLY_S: Final = 1.5
"""A step is ordered so long before its time: workers have to walk there."""
PATIENCE_S: Final = 60.0
"""A step that nothing can make for so long does not hinder later ones."""
A_WORKER_EARNS: Final = 0.9
"""Minerals a second."""
RICH: Final = 450.0
"""With so many minerals unspent there are too few producers."""
PLENTY_OF_GAS: Final = 150.0
PRODUCERS_PER_BASE: Final = 4
FULL_SHARE: Final = 0.8
"""A side expands when its bases have this share of the workers that they want."""
ORBITAL: Final = "OrbitalCommand"
ADDONS: Final = ("TechLab", "Reactor")
LEVELS: Final = ("Level1", "Level2", "Level3")


def spend(side: OwnSide, enemy: Enemy, staff: Staff) -> None:
    """Spend the money of this thought."""
    economy.keep_supply_ahead(side)
    danger = in_danger(side, enemy)
    if danger:
        train_army(side, danger=True)
    follow_plan(side, enemy)
    make_addons(side)
    change_halls(side)
    economy.train_workers(side, staff)
    make_units(side)
    research(side)
    train_army(side)
    if not danger and side.now_s >= side.due_s(side.plan.steps[-1].at_s):
        expand(side, enemy, staff)
        add_gas(side)
    build_structures(side)


def in_danger(side: OwnSide, enemy: Enemy) -> bool:
    """Return whether the army comes before everything else: enemies stronger than it are at the own bases."""
    known = enemy.army_supply() if "adapt" in side.level.skills or side.level.vision else 0.0
    return side.mind.threat is not None and composition.supply_made(side) < 1.5 * known + 4.0


# structures -----------------------------------------------------------------------------------------------------------


def follow_plan(side: OwnSide, enemy: Enemy) -> None:
    """Make what the steps of the plan want by now, also again what was lost; save for the next one in time.

    A step is done while there are as many of its type as steps until then want; a town hall is there from the start.
    """
    wanted = Counter({side.race.hall: 1})
    for step in side.plan.steps:
        left = side.due_s(step.at_s) - QUICKLY_S - side.now_s
        if left > 0.0 and left > _saving_s(side, step.what):
            return
        wanted[step.what] += 1
        if side.count(step.what) >= wanted[step.what]:
            continue
        if left > 0.0:
            side.purse.put_aside(products.ways(side.world.catalog, step.what)[0])
            return
        near = bases.next_place(side, enemy) if step.what == side.race.hall else None
        outcome = products.make(side, step.what, near=near)
        if outcome is MakeOutcome.SHORT and left > -PATIENCE_S:
            return
        if outcome is MakeOutcome.BLOCKED and step.what.endswith(ADDONS):
            products.keep_for(side, step.what)


def _saving_s(side: OwnSide, name: str) -> float:
    """Return how long it takes to earn what is missing for something."""
    price = products.ways(side.world.catalog, name)[0].minerals
    return (price - side.purse.minerals) / (A_WORKER_EARNS * max(1, len(side.workers)))


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
    """Take another base when the level has fewer than it wants, and the others are full or the money is too much."""
    hall = side.race.hall
    have = len(side.halls) - economy.mined_out(staff) + len(side.begun.get(hall, ())) + side.ordered[hall]
    full = len(side.workers) >= FULL_SHARE * staff.places
    place = bases.next_place(side, enemy) if have < side.level.bases and (full or side.owner.minerals > RICH) else None
    if place is not None:
        products.make(side, hall, near=place)


def add_gas(side: OwnSide) -> None:
    """Take the next geyser when vespene is short and there are workers for it."""
    count = side.count(side.race.gas)
    short = side.owner.vespene < PLENTY_OF_GAS
    if short and count < 2 * len(side.halls) and len(side.workers) >= 14 + 3 * count:
        products.make(side, side.race.gas)


def build_structures(side: OwnSide) -> None:
    """Make the first structure that is missing of those that the stage wants."""
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
    """Build more producers when the money is not spent and the army is too small."""
    name = side.race.producer
    most = max(1, math.floor(PRODUCERS_PER_BASE * side.level.production * max(len(side.halls), 1)))
    small = composition.supply_made(side) < side.army_wanted
    if not small or side.owner.minerals < RICH or name == side.race.hall or side.count(name) >= most:
        return
    have = side.kind(name)
    busy = all(len(side.world.jobs.get(s, ())) > 0 or side.world.unit_type(s).name == "WarpGate" for s in have)
    if have and busy:
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
    """Make single units that the stage wants, such as detectors."""
    for name, wanted in side.stage.units.items():
        if side.count(name) < _scale(side, wanted):
            products.make(side, name)


def train_army(side: OwnSide, *, danger: bool = False) -> None:
    """Make the units that the army lacks most until it is as large as wanted, in danger as many as possible."""
    shares = composition.shares(side)
    for _ in range(_free_producers(side)):
        full = composition.supply_made(side) >= side.army_wanted and not danger
        if full or not _train_first_possible(side, composition.by_need(side, shares)):
            return


def _train_first_possible(side: OwnSide, names: list[str]) -> bool:
    """Make the first unit that is possible; return whether it is paid."""
    for name in names:
        outcome = products.make(side, name) if _worth_waiting(side, name) else MakeOutcome.BLOCKED
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
