"""The effect of an order: compares, in words, observations of the same moment in games with and without the order.

A word names a kind of change and no amount, so that two ways to play the same decision can be compared: `Stalker
order Effect_Blink`, `new Zealot`, `Ghost buff GhostCloak`, `minerals`.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

from s2clientprotocol import raw_pb2

from khala_bridge.names import buff_name, order_name, unit_name, upgrade_name

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from s2clientprotocol import common_pb2
    from s2clientprotocol import sc2api_pb2 as sc

    from khala_bridge.state import Snapshot

MOVED = 0.3
"""World units from its place at which a unit counts as moved."""
_GAUGES = {"health": 0.5, "shield": 0.5, "energy": 0.5, "build_progress": 0.0005, "mineral_contents": 0.5,
           "vespene_contents": 0.5, "cargo_space_taken": 0.5, "assigned_harvesters": 0.5}  # fmt: skip
_TRAITS: dict[str, Callable[[raw_pb2.Unit], object]] = {
    "cloaked": lambda unit: unit.cloak,
    "burrowed": lambda unit: unit.is_burrowed,
    "flying": lambda unit: unit.is_flying,
    "powered": lambda unit: unit.is_powered,
    "add-on": lambda unit: unit.add_on_tag,
    "owner": lambda unit: unit.owner,
    "passengers": lambda unit: [(passenger.tag, passenger.health) for passenger in unit.passengers],
    "rally": lambda unit: [(rally.tag, rally.point.x, rally.point.y) for rally in unit.rally_targets],
    "other target": lambda unit: [(o.target_unit_tag, _rounded(o.target_world_space_pos)) for o in unit.orders],
}
_SHOWN = (raw_pb2.Visible, raw_pb2.Hidden, raw_pb2.Placeholder)
_PURSE = ("minerals", "vespene", "food_used")
_OF_THE_MOMENT = (
    *(f" {gauge}" for gauge in _GAUGES),
    " moved",
    " can ",
    " other target",
    " passengers",
    " dropped an order",
)


class Seen(NamedTuple):
    """A moment of a game."""

    snapshot: Snapshot
    response: sc.ResponseObservation
    """The message of the snapshot; it has more about a unit than other code needs."""
    autocast: Mapping[int, frozenset[int]]
    """By tag of a unit, what it does without orders; the API does not show it, the simulator's world does."""


def changes(idle: Seen, told: Seen) -> frozenset[str]:
    """Return the differences between a game with an order and the same game without it."""
    before, after = _units(idle), _units(told)
    both = sorted(before.keys() & after.keys())
    found = {word for tag in both for word in _of_unit(before[tag], after[tag])}
    found |= {word for tag in both for word in _of_card(_name(after[tag]), tag, idle, told)}
    found |= {f"gone {name}" for name in _more(before, after)} | {f"new {name}" for name in _more(after, before)}
    found |= set(_of_player(idle.response, told.response))
    return frozenset(found)


def kinds(words: frozenset[str]) -> frozenset[str]:
    """Return the words that do not depend on the exact moment: orders, types, buffs, traits, new and lost units."""
    return frozenset(word for word in words if not (word in _PURSE or any(g in word for g in _OF_THE_MOMENT)))


def _units(seen: Seen) -> dict[int, raw_pb2.Unit]:
    shown = seen.response.observation.raw_data.units
    return {unit.tag: unit for unit in shown if unit.display_type in _SHOWN}


def _name(unit: raw_pb2.Unit) -> str:
    whose = {raw_pb2.Self: "", raw_pb2.Enemy: "enemy ", raw_pb2.Neutral: "neutral "}
    return whose.get(unit.alliance, "ally ") + unit_name(unit.unit_type)


def _more(some: Mapping[int, raw_pb2.Unit], others: Mapping[int, raw_pb2.Unit]) -> Iterable[str]:
    """Return the names of units whose number has grown."""
    return Counter(map(_name, some.values())) - Counter(map(_name, others.values()))


def _of_unit(idle: raw_pb2.Unit, told: raw_pb2.Unit) -> Iterator[str]:
    name = _name(idle)
    if idle.unit_type != told.unit_type:
        yield f"{name} became {_name(told)}"
    yield from (f"{name} order {order}" for order in _orders(told) - _orders(idle))
    yield from (f"{name} buff {buff_name(buff)}" for buff in set(told.buff_ids) ^ set(idle.buff_ids))
    for gauge, least in _GAUGES.items():
        if abs(getattr(told, gauge) - getattr(idle, gauge)) > least:
            yield f"{name} {gauge}"
    for trait, read in _TRAITS.items():
        if read(told) != read(idle):
            yield f"{name} {trait}"
    if _orders(idle) - _orders(told):
        yield f"{name} dropped an order"
    if math.dist((told.pos.x, told.pos.y), (idle.pos.x, idle.pos.y)) > MOVED:
        yield f"{name} moved"


def _orders(unit: raw_pb2.Unit) -> Counter[str]:
    return Counter(order_name(order.ability_id) for order in unit.orders)


def _rounded(point: common_pb2.Point) -> tuple[int, int]:
    return round(point.x), round(point.y)


def _of_card(name: str, tag: int, idle: Seen, told: Seen) -> Iterator[str]:
    """Yield changes of what it does without orders and of its possible orders, if nothing else shows a change."""
    for ability in idle.autocast.get(tag, frozenset()) ^ told.autocast.get(tag, frozenset()):
        yield f"{name} autocast {order_name(ability)}"
    can = (seen.snapshot.abilities or {} for seen in (idle, told))
    before, after = (abilities.get(tag, frozenset()) for abilities in can)
    for ability in before ^ after:
        yield f"{name} can {order_name(ability)}"


def _of_player(idle: sc.ResponseObservation, told: sc.ResponseObservation) -> Iterator[str]:
    for gauge in _PURSE:
        if getattr(told.observation.player_common, gauge) != getattr(idle.observation.player_common, gauge):
            yield gauge
    upgrades = set(told.observation.raw_data.player.upgrade_ids) - set(idle.observation.raw_data.player.upgrade_ids)
    yield from (f"upgrade {upgrade_name(upgrade)}" for upgrade in upgrades)
    effects = {e.effect_id for e in told.observation.raw_data.effects}
    yield from (f"effect {e}" for e in effects - {e.effect_id for e in idle.observation.raw_data.effects})
