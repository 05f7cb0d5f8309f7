"""A snapshot as `bridge.rules` wants it: the side, its units and the accounts of a turn, as plain values.

The one place between the two; who asks for a judgement takes the values from here. Above: `bridge.observe`,
`bridge.act` and `bridge.macro`; below: `bridge.rules`, and `bridge.ground` for what is going to be built.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from bridge.functions import functions, general
from bridge.ground import land_of
from bridge.ground.land import built_by
from bridge.knowledge import knowledge
from bridge.names import unit_name, upgrade_name
from bridge.rules import Ledger, Side, Unit

if TYPE_CHECKING:
    from s2clientprotocol import raw_pb2

    from bridge.snapshot import Snapshot

_GATHERING = ("Harvest_Gather_screen", "Harvest_Return_quick")
_NOTHING: frozenset[int] = frozenset()
_last: list[tuple[Snapshot, Side]] = []


def side_of(snapshot: Snapshot) -> Side:
    """Return the player's side at the moment of a snapshot; all who ask about one of the last two share it."""
    for known, side in _last[:]:  # a copy: other matches of the process may ask from other threads
        if known is snapshot:
            return side
    own = snapshot.own
    side = Side(
        {unit.tag: _unit(snapshot, unit) for unit in own},
        frozenset(map(upgrade_name, snapshot.response.observation.raw_data.player.upgrade_ids)),
        frozenset(order.ability_id for unit in own for order in unit.orders),
    )
    _last[:] = [(snapshot, side), *_last[:1]]
    return side


def ledger_of(snapshot: Snapshot) -> Ledger:
    """Return the accounts at the beginning of a joint action."""
    common = snapshot.response.observation.player_common
    minerals, vespene = _planned(snapshot)
    return Ledger(
        max(common.minerals - minerals, 0.0),
        max(common.vespene - vespene, 0.0),
        float(common.food_cap) - float(common.food_used),
        (min(minerals, common.minerals), min(vespene, common.vespene)),
    )


def _unit(snapshot: Snapshot, unit: raw_pb2.Unit) -> Unit:
    name, orders = unit_name(unit.unit_type), unit.orders
    known = knowledge().get(name)
    addon = snapshot.units.get(unit.add_on_tag) if unit.add_on_tag else None
    return Unit(
        unit.tag,
        name,
        None if snapshot.abilities is None else snapshot.abilities.get(unit.tag, _NOTHING),
        unit.build_progress,
        unit.energy,
        unit_name(addon.unit_type) if addon is not None and addon.build_progress >= 1 else "",
        bool(unit.add_on_tag),
        known is None or not known.needs_power or unit.is_powered,
        len(orders),
        not orders or _gathers(orders[0].ability_id),
    )


@functools.lru_cache(4096)
def _gathers(ability: int) -> bool:
    wanted = {functions()[name].ability_id for name in _GATHERING}
    return ability in wanted or general(ability) in wanted


def _planned(snapshot: Snapshot) -> tuple[float, float]:
    """Minerals and vespene that structures will cost which workers are on their way to build."""
    if not any(_builds(ability) for ability in side_of(snapshot).ordered):
        return 0.0, 0.0
    plans = [knowledge()[structure] for structure, _ in land_of(snapshot).plans]
    drones = sum(knowledge()["Drone"].minerals for kind in plans if kind.race == "zerg")
    return sum(kind.minerals for kind in plans) - drones, sum(kind.vespene for kind in plans)


@functools.lru_cache(4096)
def _builds(ability: int) -> bool:
    return built_by(ability) is not None
