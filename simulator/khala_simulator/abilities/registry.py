"""The rules behind abilities, buffs and area effects that are not the same for all.

One module per group of units. Each offers some of these tables, and here they are joined:

* ``SKILLS``: an ability's ``effect`` → ``Skill``
* ``AREA_EFFECTS``: an area effect's ``rule`` → what it does at each period
* ``TICKS`` and ``ENDS``: a buff's name → what it does at each of its periods, and when it has run out
* ``FINALS``: a buff's name → what it does when its bearer dies, called with the slot while it is still there
* ``SMARTS``: what a right click means to some units, called with the slots, the target's slot, the point and whether to
  queue it; returns those that took it
* ``PASSIVES``: a unit type's name → what units of it do in every loop without an order
* ``OF_BUFFS``: those of these types whose rule is about their buffs, and has nothing to do while nobody has any
* ``DEATHS``: a unit type's name → what happens when one dies, called with the slot while it is still there

``casting`` and the systems look things up here; the modules know the world and nothing above it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, TypeVar

from khala_simulator.abilities.protoss import (
    battery,
    carrier,
    gateway,
    mothership,
    robotics,
    sentry,
    stargate,
    templar,
    warpgate,
)
from khala_simulator.abilities.shared import basics, construction, harvest, production, research, transports
from khala_simulator.abilities.terran import addons, bunkers, terran_tables
from khala_simulator.abilities.zerg import zerg_tables

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_simulator.abilities.skill import AreaEffectRule, BuffRule, Skill, SmartRule, UnitRule
    from khala_simulator.world.world import World


T = TypeVar("T")


def _join(*tables: dict[str, Callable[[World, T], None]]) -> dict[str, Callable[[World, T], None]]:
    """Return the joined rules of several tables; a type in more than one of them runs all its rules in turn."""
    rules: dict[str, list[Callable[[World, T], None]]] = {}
    for table in tables:
        for name, rule in table.items():
            rules.setdefault(name, []).append(rule)
    return {name: found[0] if len(found) == 1 else _in_turn(found) for name, found in rules.items()}


def _in_turn(rules: list[Callable[[World, T], None]]) -> Callable[[World, T], None]:
    def all_of_them(world: World, bearers: T) -> None:
        for rule in rules:
            rule(world, bearers)

    return all_of_them


SKILLS: Final[dict[str, Skill]] = {
    **basics.SKILLS,
    **harvest.SKILLS,
    **production.SKILLS,
    **construction.SKILLS,
    **addons.SKILLS,
    **warpgate.SKILLS,
    **research.SKILLS,
    **sentry.SKILLS,
    **templar.SKILLS,
    **gateway.SKILLS,
    **robotics.SKILLS,
    **stargate.SKILLS,
    **mothership.SKILLS,
    **battery.SKILLS,
    **terran_tables.SKILLS,
    **transports.SKILLS,
    **bunkers.SKILLS,
    **carrier.SKILLS,
    **zerg_tables.SKILLS,
}
AREA_EFFECTS: Final[dict[str, AreaEffectRule]] = {
    **sentry.AREA_EFFECTS,
    **templar.AREA_EFFECTS,
    **gateway.AREA_EFFECTS,
    **robotics.AREA_EFFECTS,
    **stargate.AREA_EFFECTS,
    **mothership.AREA_EFFECTS,
    **terran_tables.AREA_EFFECTS,
    **zerg_tables.AREA_EFFECTS,
}
TICKS: Final[dict[str, BuffRule]] = {
    **templar.TICKS,
    **mothership.TICKS,
    **terran_tables.TICKS,
    **zerg_tables.TICKS,
}
ENDS: Final[dict[str, BuffRule]] = {
    **robotics.ENDS,
    **stargate.ENDS,
    **terran_tables.ENDS,
    **zerg_tables.ENDS,
}
FINALS: Final[dict[str, BuffRule]] = {**zerg_tables.FINALS}
PASSIVES: Final[dict[str, UnitRule]] = _join(
    sentry.PASSIVES,
    gateway.PASSIVES,
    robotics.PASSIVES,
    stargate.PASSIVES,
    mothership.PASSIVES,
    terran_tables.PASSIVES,
    transports.PASSIVES,
    carrier.PASSIVES,
    zerg_tables.PASSIVES,
    warpgate.PASSIVES,
)
OF_BUFFS: Final = gateway.OF_BUFFS
SMARTS: Final[tuple[SmartRule, ...]] = (
    *construction.SMARTS,
    *battery.SMARTS,
    *transports.SMARTS,
    *production.SMARTS,
    *terran_tables.SMARTS,
)
DEATHS: Final[dict[str, Callable[[World, int], None]]] = _join(
    harvest.DEATHS, transports.DEATHS, carrier.DEATHS, zerg_tables.DEATHS, terran_tables.DEATHS
)
