"""A snapshot as input for `khala_bridge.rules`: the side, its units and the accounts of a turn, as plain values.

The only link between the two: every caller of a judgement takes the values from here. Above: `khala_bridge.observe`,
`khala_bridge.act` and `khala_bridge.auto`; below: `khala_bridge.rules`, and `khala_bridge.state.ground` for planned
structures.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from khala_bridge.catalogue.functions import functions, general
from khala_bridge.rules import Ledger, SideState, UnitState
from khala_bridge.state.ground import land_of
from khala_bridge.state.ground.land import built_by

if TYPE_CHECKING:
    from khala_bridge.state import Snapshot, Unit

_GATHERING = ("Harvest_Gather_screen", "Harvest_Return_quick")
_NOTHING: frozenset[int] = frozenset()
_last: list[tuple[Snapshot, SideState]] = []


def side_of(snapshot: Snapshot) -> SideState:
    """Return the player's side at the moment of a snapshot; cached for the last two snapshots."""
    for known, side in _last[:]:  # a copy: other threads of the process may play other matches
        if known is snapshot:
            return side
    own = snapshot.own
    side = SideState(
        snapshot.facts,
        {unit.tag: _unit(snapshot, unit) for unit in own},
        frozenset(snapshot.upgrades),
        frozenset(order.ability_id for unit in own for order in unit.orders),
    )
    _last[:] = [(snapshot, side), *_last[:1]]
    return side


def ledger_of(snapshot: Snapshot) -> Ledger:
    """Return the accounts at the beginning of a joint action."""
    common = snapshot.player
    minerals, vespene = _plan_costs(snapshot)
    return Ledger(
        max(common.minerals - minerals, 0.0),
        max(common.vespene - vespene, 0.0),
        float(common.food_cap) - float(common.food_used),
        (min(minerals, common.minerals), min(vespene, common.vespene)),
    )


def _unit(snapshot: Snapshot, unit: Unit) -> UnitState:
    name, orders = unit.name, unit.orders
    known = unit.facts
    addon = snapshot.units.get(unit.add_on_tag) if unit.add_on_tag else None
    return UnitState(
        unit.tag,
        name,
        None if snapshot.abilities is None else snapshot.abilities.get(unit.tag, _NOTHING),
        unit.build_progress,
        unit.energy,
        addon.name if addon is not None and addon.build_progress >= 1 else "",
        bool(unit.add_on_tag),
        known is None or not known.needs_power or unit.is_powered,
        len(orders),
        not orders or _gathers(orders[0].ability_id),
        _is_disarmed(snapshot, unit),
    )


def _is_disarmed(snapshot: Snapshot, unit: Unit) -> bool:
    """Return True if a buff disarms a unit, or if it holds up another one with its beam, which no buff of it shows."""
    facts = snapshot.facts
    if any(buff in facts.buffs and "disarmed" in facts.buffs[buff].flags for buff in unit.buffs):
        return True
    if not unit.orders:
        return False
    order = unit.orders[0]
    held = snapshot.units.get(order.target_unit_tag)
    ability = facts.abilities.get(order.ability_id) if held is not None and "GravitonBeam" in held.buffs else None
    return ability is not None and ability.does == "graviton_beam"


@functools.lru_cache(4096)
def _gathers(ability: int) -> bool:
    wanted = {functions()[name].ability_id for name in _GATHERING}
    return ability in wanted or general(ability) in wanted


def _plan_costs(snapshot: Snapshot) -> tuple[float, float]:
    """Return the minerals and vespene for structures that workers are on their way to build."""
    if not any(_builds(ability) for ability in side_of(snapshot).ordered):
        return 0.0, 0.0
    units = snapshot.facts.units
    plans = [units[structure] for structure, _ in land_of(snapshot).plans]
    drones = sum(units["Drone"].minerals for kind in plans if kind.race == "zerg")
    return sum(kind.minerals for kind in plans) - drones, sum(kind.vespene for kind in plans)


@functools.lru_cache(4096)
def _builds(ability: int) -> bool:
    return built_by(ability) is not None
