"""Scouting: the places where enemies may be, the most promising first, and the unit that goes there."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_bridge.auto.builders import use
from khala_bridge.auto.rule import RuleOrder, not_available
from khala_bridge.frames import WorldPoint
from khala_bridge.state.ground import land_of
from khala_bridge.state.ground.land import SEEN_NOW
from khala_bridge.state.side import ability, finished, is_doing, is_worker, of_types, place

if TYPE_CHECKING:
    from khala_bridge.auto.rule import RuleRequest
    from khala_bridge.state import Snapshot, Unit
    from khala_bridge.state.ground import Land

ROUND_LOOPS: Final = 1344
"""A minute: when everything was seen once, the first place to look at changes this often."""
SAME_PLACE: Final = 4.0
"""A unit on its way to a point within this distance of a place scouts the place already."""
CELL: Final = 8
"""Side of the squares into which the rest of the map is cut, in cells."""


def scout(ask: RuleRequest) -> list[RuleOrder]:
    """Send the nearest free unit of a kind to the first place that no unit scouts yet.

    Raises:
        NotAvailable: no such unit is free.
    """
    units = [u for u in finished(of_types(ask.snapshot, ask.action.units)) if u.tag not in ask.ledger.busy]
    if not units:
        wanted = " or ".join(ask.action.units)
        raise not_available(ask, f"you have no {wanted} without an order in this turn.")
    home = next(map(place, land_of(ask.snapshot).own_halls), place(units[0]))
    places = unseen_places(ask.snapshot, home)
    goals = {unit.tag: goal for unit in ask.snapshot.own if (goal := _goal(unit)) is not None}
    looking = [(n, unit) for unit in units if (n := _seen_by(places, goals.get(unit.tag))) is not None]
    if looking:  # it continues, so that the same words mean the same in the next turn
        number, unit = min(looking, key=lambda found: (found[0], found[1].tag))
        return _look(ask, unit, places[number])
    watched = {_seen_by(places, WorldPoint(*goal)) for goal in (*goals.values(), *ask.ledger.looks)}
    to = next((point for number, point in enumerate(places) if number not in watched), places[0])
    return _look(ask, min(units, key=lambda u: (_importance(ask.snapshot, u), math.dist(place(u), to), u.tag)), to)


def _look(ask: RuleRequest, unit: Unit, to: WorldPoint) -> list[RuleOrder]:
    ask.ledger.take(unit.tag)
    ask.ledger.looks.append((to.x, to.y))
    return [RuleOrder(ask.function, (unit.tag,), to)]


def _goal(unit: Unit) -> WorldPoint | None:
    """Return the point that a unit walks to; None if it builds or gathers."""
    if not is_doing(unit, ability("Move_screen"), ability("Attack_screen")):
        return None
    return unit.orders[0].target_world_space_pos


def _seen_by(places: list[WorldPoint], goal: WorldPoint | None) -> int | None:
    """Return the number of the place that a unit scouts on its way to a point."""
    if goal is None:
        return None
    return next((n for n, p in enumerate(places) if abs(p.x - goal.x) + abs(p.y - goal.y) <= SAME_PLACE), None)


def _importance(snapshot: Snapshot, unit: Unit) -> int:
    """Return how important a unit's present work is."""
    return int(use(snapshot, unit)) if is_worker(unit) else 0


def unseen_places(snapshot: Snapshot, home: WorldPoint) -> list[WorldPoint]:
    """Return places to look for the enemy, the most promising first; at least one.

    First unseen starts of players, then unseen places for a base, then the unseen rest of the map. When everything was
    seen once: the starts and base places that are out of sight now, with another one first every minute.
    """
    land = land_of(snapshot)

    def order(points: list[WorldPoint]) -> list[WorldPoint]:
        return sorted(points, key=lambda point: (round(math.dist(point, home), 3), point))

    starts = list(land.ground.starts)
    bases = [base.place for base in land.bases]
    squares = _never(land, _squares(land, home))
    never_seen = [*order(_never(land, starts)), *order(_never(land, bases)), *order(squares)]
    if never_seen:
        return list(dict.fromkeys(never_seen))
    hidden = order([p for p in dict.fromkeys((*starts, *bases)) if land.sight[_cell(land, p)] < SEEN_NOW])
    if not hidden:
        return starts or bases or [home]
    turn = snapshot.game_loop // ROUND_LOOPS % len(hidden)
    return [*hidden[turn:], *hidden[:turn]]


def _never(land: Land, points: list[WorldPoint]) -> list[WorldPoint]:
    return [point for point in points if not land.sight[_cell(land, point)]]


def _cell(land: Land, point: WorldPoint) -> tuple[int, int]:
    width, height = land.ground.size
    return min(max(int(point.x), 0), width - 1), min(max(int(point.y), 0), height - 1)


def _squares(land: Land, home: WorldPoint) -> list[WorldPoint]:
    """Return the middles of the map's squares that units can walk to from home."""
    width, height = land.ground.size
    x, y = np.meshgrid(np.arange(CELL // 2, width, CELL), np.arange(CELL // 2, height, CELL), indexing="ij")
    walkable = np.isfinite(land.ground.ways_from(home)[x, y])
    return [WorldPoint(i + 0.5, j + 0.5) for i, j in zip(x[walkable].tolist(), y[walkable].tolist(), strict=True)]
