"""The host's own orders, if a task asks for them: workers gather, town halls train them, Gateways become WarpGates.

They come after the agents' orders and use what is left: never a unit that an agent has ordered in the same turn, never
minerals that an agent has spent. `AutoConfig` says what is switched on; by default nothing is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from khala_bridge.auto.builders import GAS_STRUCTURES
from khala_bridge.auto.rule import RuleOrder
from khala_bridge.catalogue.functions import functions
from khala_bridge.rules import price_of, use_of, why_not
from khala_bridge.state.ground import land_of
from khala_bridge.state.means import side_of
from khala_bridge.state.side import ability, bears_resources, finished, is_doing, name, of_types, place, workers

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_bridge.frames import WorldPoint
    from khala_bridge.rules import Ledger
    from khala_bridge.state import Snapshot, Unit
    from khala_bridge.task.config import AutoConfig

PER_FIELD: Final = 2
"""Workers for each mineral field."""
PER_GAS: Final = 3
OF_HALL: Final = 10.0
"""Resources within this distance of a town hall are gathered into it."""
MOST_WORKERS: Final = 75
"""Workers up to which the host trains more; the figure of LLM-PySC2's code."""
TRAINED: Final = {
    "Nexus": "Train_Probe_quick",
    "CommandCenter": "Train_SCV_quick",
    "OrbitalCommand": "Train_SCV_quick",
    "PlanetaryFortress": "Train_SCV_quick",
    "Larva": "Train_Drone_quick",
}
GATHER: Final = "Harvest_Gather_screen"
MORPH: Final = "Morph_WarpGate_quick"


def automatic(auto: AutoConfig, snapshot: Snapshot, ledger: Ledger, ordered: frozenset[int]) -> list[RuleOrder]:
    """Return the host's own orders beside a joint action; deterministic.

    Args:
        auto: what is switched on.
        snapshot: what the agents saw.
        ledger: what their calls left; it is changed.
        ordered: tags of the units that agents have ordered in this turn.
    """
    taken = ordered | ledger.busy
    orders: list[RuleOrder] = []
    if auto.warpgates:
        orders += _warpgates(snapshot, ledger, taken)
    if auto.train_workers:
        orders += _train(snapshot, ledger, taken)
    if auto.gather:
        orders += _gather(snapshot, taken)
    return orders


# Gateways -------------------------------------------------------------------------------------------------------------


def _warpgates(snapshot: Snapshot, ledger: Ledger, taken: frozenset[int] | set[int]) -> list[RuleOrder]:
    gateways = [
        unit.tag
        for unit in side_of(snapshot).of_types(("Gateway",))
        if unit.tag not in taken and _can(MORPH, unit.tag, snapshot, ledger)
    ]
    ledger.changing.update(gateways)
    return [RuleOrder(functions()[MORPH], tuple(gateways))] if gateways else []


def _can(function: str, tag: int, snapshot: Snapshot, ledger: Ledger) -> bool:
    side = side_of(snapshot)
    return why_not(use_of(functions()[function], by_host=True, of_side=True), side.units[tag], side, ledger) is None


# training -------------------------------------------------------------------------------------------------------------


def _train(snapshot: Snapshot, ledger: Ledger, taken: frozenset[int] | set[int]) -> list[RuleOrder]:
    """Return orders for one worker from each idle town hall; from Larvae, as many as there are town halls."""
    posts = _posts(snapshot)
    making = [order for unit in snapshot.own for order in unit.orders if order.ability_id in _trainings()]
    left = min(sum(post.room for post in posts), MOST_WORKERS - len(workers(snapshot))) - len(making)
    producers = finished(of_types(snapshot, [kind for kind in TRAINED if kind != "Larva"]))
    larvae = of_types(snapshot, ("Larva",))[: len(finished(land_of(snapshot).own_halls))]
    orders = []
    for unit in (*producers, *larvae):
        function = functions()[TRAINED[name(unit)]]
        free = not (unit.orders or ledger.queued[unit.tag] or unit.tag in taken)
        if left > 0 and free and _can(function.name, unit.tag, snapshot, ledger):
            ledger.pay(price_of(snapshot.facts.abilities[function.ability_id]))
            ledger.queued[unit.tag] += 1
            orders.append(RuleOrder(function, (unit.tag,)))
            left -= 1
    return orders


def _trainings() -> set[int]:
    return {ability(function) for function in TRAINED.values()}


# gathering ------------------------------------------------------------------------------------------------------------


@dataclass(slots=True)
class _Post:
    """Where workers gather: the mineral fields of a town hall, or one gas structure."""

    hall: WorldPoint
    target: int
    has: int
    wants: int
    gas: bool

    @property
    def room(self) -> int:
        return max(self.wants - self.has, 0)

    @property
    def fill(self) -> float:
        return self.has / self.wants if self.wants else math.inf


def _gather(snapshot: Snapshot, taken: frozenset[int] | set[int]) -> list[RuleOrder]:
    """Send idle workers to work, and some from full places to those with room."""
    posts = _posts(snapshot)
    if not posts:
        return []
    idle = [worker for worker in workers(snapshot) if not worker.orders and worker.tag not in taken]
    return [*_employ(posts, idle), *_rebalance(snapshot, posts, taken)]


def _employ(posts: list[_Post], idle: list[Unit]) -> Iterator[RuleOrder]:
    """Yield each idle worker with the place that needs it most."""
    for worker in idle:
        post = _post_for(posts, worker)
        post.has += 1
        yield RuleOrder(functions()[GATHER], (worker.tag,), post.target)


def _posts(snapshot: Snapshot) -> list[_Post]:
    """Return every place where workers gather for a finished town hall, by the tags of the halls."""
    land = land_of(snapshot)
    fields = [unit for unit in land.standing("mineral_field") if unit.tag in snapshot.units]
    gas = [u for u in finished(of_types(snapshot, GAS_STRUCTURES)) if u.vespene_contents > 0]
    return [post for hall in finished(land.own_halls) for post in _posts_of(hall, fields, gas)]


def _posts_of(hall: Unit, fields: list[Unit], gas: list[Unit]) -> Iterator[_Post]:
    at = place(hall)
    own = sorted((math.dist(place(f), at), f.tag) for f in fields if math.dist(place(f), at) <= OF_HALL)
    if own:
        yield _Post(at, own[0][1], hall.assigned_harvesters, PER_FIELD * len(own), gas=False)
    for unit in gas:
        if math.dist(place(unit), at) <= OF_HALL:
            yield _Post(at, unit.tag, unit.assigned_harvesters, PER_GAS, gas=True)


def _post_for(posts: list[_Post], worker: Unit) -> _Post:
    """Return the place for an idle worker: the emptiest at the nearest town hall with room, else the nearest."""

    def rank(post: _Post) -> tuple[bool, float, float, bool, int]:
        return not post.room, round(math.dist(post.hall, place(worker)), 3), post.fill, post.gas, post.target

    return min(posts, key=rank)


def _rebalance(snapshot: Snapshot, posts: list[_Post], taken: frozenset[int] | set[int]) -> Iterator[RuleOrder]:
    """Yield moves of workers from full places to emptier ones: to the gas of the same base, and to other bases."""
    free = [
        worker
        for worker in workers(snapshot)
        if worker.tag not in taken and is_doing(worker, ability(GATHER)) and not bears_resources(worker)
    ]
    for to in posts:
        for source in posts:
            if source.gas or not to.room or not _gives(source, to):
                continue
            own = [w for w in free if _gathers_minerals(snapshot, w) and math.dist(place(w), source.hall) <= OF_HALL]
            worker = min(own, key=lambda w: (math.dist(place(w), to.hall), w.tag), default=None)
            if worker is not None:
                free.remove(worker)
                source.has, to.has = source.has - 1, to.has + 1
                yield RuleOrder(functions()[GATHER], (worker.tag,), to.target)


def _gives(source: _Post, to: _Post) -> bool:
    """Return True if the mineral fields of a town hall have a worker to spare for another place."""
    if to.gas and source.hall == to.hall:
        return source.fill > to.fill
    return not to.gas and source.hall != to.hall and source.has > source.wants


def _gathers_minerals(snapshot: Snapshot, worker: Unit) -> bool:
    target = land_of(snapshot).unit(worker.orders[0].target_unit_tag)
    return target is None or name(target) not in GAS_STRUCTURES
