"""The start of a melee game: a town hall and twelve workers for every player, already gathering.

Where the workers stand is a rule that was measured on 96 recorded starts: of the 24 cells around the town hall those
twelve that are nearest to the middle of its mineral fields (all twelve right in 87 starts, eleven in the other nine).
All begin with an order for the same field, to which the town hall sends new workers as well. They face anywhere, and
the camera is at their mean. Above: ``systems.staging``. Below: ``world``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from khala_simulator.combat import lifecycle
from khala_simulator.world.players import NEUTRAL, GameResult
from khala_simulator.world.world import Rally

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from khala_simulator.numeric.geometry import Floats
    from khala_simulator.world.columns import Ints
    from khala_simulator.world.world import World

WORKERS: Final = 12
RING: Final = 3  # cells from the town hall's centre
BASE_RADIUS: Final = 10.0  # largest distance from a town hall to its own mineral fields
FIRST_FIELD: Final = 5  # the workers' first field is usually the fifth or sixth nearest
STRUCTURE_FACING: Final = 3.927
HALL_AND_WORKER: Final = {
    "protoss": ("Nexus", "Probe"),
    "terran": ("CommandCenter", "SCV"),
    "zerg": ("Hatchery", "Drone"),
}
LARVAE: Final = ((-1.0, -3.25), (0.0, -3.25), (1.0, -3.25))  # offsets from the Hatchery


def start(world: World) -> Iterator[tuple[list[int], int]]:
    """Give every player of the scenario a base, by chance where the scenario names no place.

    Yield, after each base, its workers (slots) and the mineral field (tag) that they gather from.
    """
    scenario = world.map.scenario
    free = [scenario.start_locations[i] for i in world.rng.permutation(len(scenario.start_locations)).tolist()]
    for player in world.players[1:]:
        spec = scenario.players.get(player.id)
        if player.race not in HALL_AND_WORKER:
            player.race = list(HALL_AND_WORKER)[int(world.rng.integers(len(HALL_AND_WORKER)))]
        place = spec.start if spec is not None and spec.start is not None else free.pop(0) if free else None
        if place is not None:
            yield from _found_base(world, player.id, place)


def _found_base(world: World, player: int, place: tuple[float, float]) -> Iterator[tuple[list[int], int]]:
    owner = world.players[player]
    owner.start = place
    hall, worker = (world.catalog.unit(name) for name in HALL_AND_WORKER[owner.race])
    home = lifecycle.spawn(world, hall, player, place, STRUCTURE_FACING)
    fields = mineral_fields(world, place)
    middle = world.pos[fields].mean(axis=0) if len(fields) else np.array(place)
    ring = worker_places(place, middle)
    facings = world.rng.uniform(0.0, 2.0 * math.pi, len(ring)).tolist()
    workers = [
        lifecycle.spawn(world, worker, player, (x, y), f) for (x, y), f in zip(ring.tolist(), facings, strict=True)
    ]
    x, y = ring.mean(axis=0).tolist()
    owner.camera = (x, y)
    if owner.race == "zerg":
        _hatch(world, player, place, middle)
    if len(fields):
        first = int(fields[min(FIRST_FIELD, len(fields)) - 1])
        x, y = world.pos[first].tolist()
        world.rallies[home] = {"workers": Rally((x, y), world.tag_of(first))}
        yield workers, world.tag_of(first)


def _hatch(world: World, player: int, place: tuple[float, float], minerals: Floats) -> None:
    """Place the first Larvae, and the Overlord at the corner of the workers' ring away from the ``minerals``."""
    away = np.where(minerals > place, -1.0, 1.0) * RING
    for name, offsets in (("Larva", LARVAE), ("Overlord", (tuple(away.tolist()),))):
        for dx, dy in offsets:
            lifecycle.spawn(world, world.catalog.unit(name), player, (place[0] + dx, place[1] + dy))


def mineral_fields(world: World, place: tuple[float, float]) -> Ints:
    """Return the slots of the mineral fields of the base at ``place``, nearest first."""
    live = world.live
    minerals = np.array([unit.resource == "minerals" for unit in world.catalog.units])
    fields = live[minerals[world.type[live]] & (world.owner[live] == NEUTRAL)]
    squared = ((world.pos[fields] - place) ** 2).sum(axis=1)
    order = np.argsort(squared, kind="stable")
    nearest: Ints = fields[order[squared[order] <= BASE_RADIUS**2]]
    return nearest


def worker_places(hall: tuple[float, float], minerals: Floats) -> Floats:
    """Return (12, 2) where the workers stand, nearest to the middle of the ``minerals`` first."""
    side = np.arange(-RING, RING + 1)
    x, y = (axis.ravel() for axis in np.meshgrid(side, side))
    on_ring = np.maximum(np.abs(x), np.abs(y)) == RING
    ring = np.stack([x[on_ring], y[on_ring]], axis=1) + np.array(hall)
    squared = ((ring - minerals) ** 2).sum(axis=1)
    order = np.lexsort((ring[:, 0], ring[:, 1], np.round(squared, 6)))
    places: Floats = ring[order[:WORKERS]]
    return places


def judge(world: World) -> None:
    """End the game when at most one of the starting players has a structure left."""
    started = [player.id for player in world.players[1:] if player.start is not None]
    standing = set(_with_structures(world, started))
    if len(standing) == len(started) or len(standing) > 1:
        return
    lost = GameResult.DEFEAT if standing or len(started) == 1 else GameResult.TIE
    world.end({player: GameResult.VICTORY if player in standing else lost for player in started})


def _with_structures(world: World, players: Iterable[int]) -> list[int]:
    structure = np.array([unit.structure for unit in world.catalog.units])
    return [p for p in players if bool(structure[world.type[world.units_of(p)]].any())]
