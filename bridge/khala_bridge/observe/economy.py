"""The economy of a side: income, spending, workers, and when supply runs out.

A function of a scene and of the accounts of the last minute in the chronicle; for agents that build and train.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_bridge.knowledge import is_worker
from khala_bridge.observe.landmarks import GAS_STRUCTURES
from khala_bridge.state.ground import land_of
from khala_protocol.messages import LOOPS_PER_S, Economy

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_bridge.knowledge import MapFacts
    from khala_bridge.observe.chronicle import Chronicle
    from khala_bridge.observe.scene import SideScene
    from khala_bridge.state import Unit

MOST_SUPPLY = 200


def economy(scene: SideScene, chronicle: Chronicle) -> Economy:
    """Return what comes in, what it is spent on, and what is short soon."""
    own, player = scene.snapshot.own, scene.snapshot.player
    halls = [unit for unit in land_of(scene.snapshot).own_halls if unit.build_progress >= 1]
    gas = [unit for unit in own if unit.name.removesuffix("Rich") in GAS_STRUCTURES and unit.build_progress >= 1]
    minerals, vespene = scene.snapshot.score.income
    coming = _supply_coming(own, scene.snapshot.facts)
    return Economy(
        income=(round(minerals), round(vespene)),
        spending=_spending(chronicle),
        gatherers=(_harvesters(halls), _harvesters(gas), sum(is_worker(u.name) and not u.orders for u in own)),
        room=(_ideal(halls), _ideal(gas)),
        supply_coming=coming,
        full_in_s=_full_in_s(chronicle, min(MOST_SUPPLY, player.food_cap + coming) - player.food_used),
        casters=_casters(own),
    )


def _harvesters(structures: Iterable[Unit]) -> int:
    return sum(unit.assigned_harvesters for unit in structures)


def _ideal(structures: Iterable[Unit]) -> int:
    return sum(unit.ideal_harvesters for unit in structures)


def _spending(chronicle: Chronicle) -> tuple[int, int]:
    """Return minerals and vespene spent in the last minute, or since the episode began."""
    (first, *_), last = chronicle.accounts, chronicle.accounts[-1]
    return round(last.spent[0] - first.spent[0]), round(last.spent[1] - first.spent[1])


def _full_in_s(chronicle: Chronicle, left: float) -> float | None:
    first, last = chronicle.accounts[0], chronicle.accounts[-1]
    used, loops = last.supply_used - first.supply_used, last.loop - first.loop
    if used <= 0 or not loops:
        return None
    return round(max(0.0, left) * loops / LOOPS_PER_S / used)


def _supply_coming(own: Iterable[Unit], facts: MapFacts) -> float:
    """Return the supply of what is under construction, and of what hatches or is trained."""
    building = sum(_provides(facts, unit.name) for unit in own if unit.build_progress < 1)
    busy = (unit for unit in own if unit.orders and not is_worker(unit.name))
    return building + sum(_provides(facts, _product(facts, unit.orders[0].ability_id)) for unit in busy)


def _provides(facts: MapFacts, name: str) -> float:
    known = facts.units.get(name)
    return known.provides if known else 0.0


def _product(facts: MapFacts, ability: int) -> str:
    known = facts.abilities.get(ability)
    return known.produces or "" if known and known.does == "train" else ""


def _casters(own: Iterable[Unit]) -> dict[str, tuple[int, ...]]:
    found: dict[str, list[int]] = {}
    for unit in own:
        if unit.energy_max and unit.build_progress >= 1:
            found.setdefault(unit.name, []).append(int(unit.energy))
    return {name: tuple(sorted(found[name], reverse=True)) for name in sorted(found)}
