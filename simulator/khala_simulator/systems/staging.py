"""Staging: what a map's script does to the world, from the units at the start to the result.

One function for each kind of action of ``script``. ``triggers`` decides when one is due, ``placement`` where there is
room.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from khala_simulator.abilities import casting, commands
from khala_simulator.combat import lifecycle
from khala_simulator.economy import melee_start
from khala_simulator.maps.places import PlaceGrid, RandomPlace, ZigZag, kind_of_place
from khala_simulator.maps.scenario import MELEE_MINERALS
from khala_simulator.maps.script import (
    AddScore,
    Create,
    Draw,
    EndGame,
    Give,
    OrderUnits,
    Regroup,
    Remove,
    Select,
    SpawnGroups,
)
from khala_simulator.movement.placement import free_places
from khala_simulator.world.players import NEUTRAL, GameResult

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from khala_simulator.maps.places import Region
    from khala_simulator.maps.script import Action, CreateSpec, OrderSpec, RegroupSpec, Who
    from khala_simulator.tables.records import UnitType
    from khala_simulator.world.columns import Ints
    from khala_simulator.world.world import World

    Point = tuple[float, float]

OUTCOMES: Final = {"victory": GameResult.VICTORY, "defeat": GameResult.DEFEAT, "tie": GameResult.TIE}
DRAWS: Final = 200  # tries to find a random place that is far enough from others; then the best of them is taken
TAU: Final = 2.0 * math.pi


def set_up(world: World) -> None:
    """Give players what they have at the start, and put the units of the map into the world."""
    scenario = world.map.scenario
    for player in world.players[1:]:
        spec = scenario.players.get(player.id)
        given = None if spec is None else spec.minerals
        player.minerals = (MELEE_MINERALS if scenario.melee else 0.0) if given is None else given
        player.vespene = 0.0 if spec is None else spec.vespene
        known = {upgrade.name: upgrade.id for upgrade in world.catalog.upgrades}
        for name in () if spec is None else spec.upgrades:
            if name in known:  # another version of the game may not have it
                commands.grant_upgrade(world, player.id, known[name])
    for units in scenario.units:
        create(world, units, placed=True)
    if scenario.melee:
        for workers, field in melee_start.start(world):
            commands.gather(world, workers, field)


def act(world: World, action: Action, subject: int) -> None:
    """Carry out one action; ``subject`` is the slot of the unit that was touched, or NOBODY."""
    if isinstance(action, Remove):
        if action.remove == "touched":
            lifecycle.remove(world, subject)
        else:
            for slot in units_like(world, action.remove).tolist():
                lifecycle.remove(world, slot)
        return
    _ACTIONS[type(action)](world, action)


# units ----------------------------------------------------------------------------------------------------------------


def create(world: World, spec: CreateSpec, *, placed: bool = False) -> list[int]:
    """Make the units of a specification, and return their slots; an absent player gets none.

    A single unit that is ``placed`` on the map stands exactly at its point, whatever else is there.
    """
    if spec.player >= len(world.players):
        return []
    slots = []
    unit = world.catalog.unit(spec.unit)
    alone = placed and spec.count == 1 and not unit.structure and kind_of_place(spec.at) in {"name", "point"}
    exact = spec.model_copy(update={"at": (point_of(world, spec.at),)}) if alone else spec
    for x, y, facing in _places(world, unit, exact):
        slot = lifecycle.spawn(world, unit, spec.player, (x, y), facing)
        world.listed_last[slot] = spec.player > 0 and bool(world.rng.integers(2))
        slots.append(slot)
        if spec.life is not None:
            world.life[slot] = min(spec.life, float(world.life_max[slot]))
        if spec.energy is not None:
            world.energy[slot] = min(spec.energy, float(world.energy_max[slot]))
        for name, count in spec.cargo.items():
            for _ in range(count):
                inside = lifecycle.spawn(world, world.catalog.unit(name), spec.player, (x, y), facing)
                lifecycle.stow(world, inside, slot)
    return slots


def _places(world: World, unit: UnitType, spec: CreateSpec) -> Iterator[tuple[float, float, float]]:
    """Yield x, y and facing of every unit, one after the other, because a random place depends on those before it."""
    facing = 0.0 if spec.facing == "random" else spec.facing
    for place in _spots(world, unit, spec.at, spec.count):
        if not world.room:
            return
        turned = place[2] if len(place) > 2 else facing
        if spec.facing == "random":
            turned = float(world.rng.uniform(0.0, TAU))
        yield *_on_map(world, place[0], place[1]), turned


def _spots(world: World, unit: UnitType, at: Any, count: int) -> Iterator[tuple[float, ...]]:
    if isinstance(at, RandomPlace):
        for _ in range(count):
            yield free_places(world, unit, random_place(world, unit, at), 1)[0]
    elif isinstance(at, PlaceGrid):
        x0, y0 = (0.0, 0.0) if at.around is None else point_of(world, at.around)
        yield from ((x0 + x, y0 + y) for y in at.y for x in at.x)
    elif isinstance(at, ZigZag):
        x0, y0 = point_of(world, at.column)
        yield from ((x0, y0 + at.step * (i // 2) * (1 if i % 2 == 0 else -1)) for i in range(1, count + 1))
    elif isinstance(at, str) or not isinstance(at[0], tuple):
        yield from free_places(world, unit, point_of(world, at), count)
    else:
        yield from (place for place in at for _ in range(count))


def _on_map(world: World, x: float, y: float) -> Point:
    """Return the nearest point on the map: a grid, a column or a region may reach beyond it."""
    width, height = world.map.terrain.size
    return min(max(x, 0.0), float(width)), min(max(y, 0.0), float(height))


def random_place(world: World, unit: UnitType, at: RandomPlace) -> Point:
    """Return a random point of the region on which the unit can stand, with the required distance to others."""
    region = world.map.scenario.regions[at.random_in]
    best = (0.0, 0.0)
    best_slack = -math.inf
    for point in _points_in(world, region):
        if not _can_stand(world, unit, point):
            continue
        slack = min((_gap_to(world, name, point) - apart for name, apart in at.away_from.items()), default=0.0)
        if slack > best_slack:
            best, best_slack = point, slack
        if slack >= 0.0:
            break
    return best


def _points_in(world: World, region: Region) -> Iterator[Point]:
    """Yield uniform random points of a region; for a region too thin to hit within its box, its middle."""
    x0, y0, x1, y1 = region.box
    yielded = False
    for _ in range(DRAWS):
        point = np.array([[world.rng.uniform(x0, x1), world.rng.uniform(y0, y1)]])
        if region.covers(point)[0]:
            yielded = True
            yield float(point[0, 0]), float(point[0, 1])
    if not yielded:
        yield (x0 + x1) / 2.0, (y0 + y1) / 2.0


def _can_stand(world: World, unit: UnitType, point: Point) -> bool:
    if unit.flying:
        return True
    x, y = int(point[0]), int(point[1])
    height, width = world.ground.walk.shape
    return 0 <= x < width and 0 <= y < height and bool(world.ground.walk[y, x])


def _gap_to(world: World, name: str, point: Point) -> float:
    """Return the distance from a point to the nearest unit of a type, centre to centre; infinite without one."""
    others = world.live[world.type[world.live] == world.catalog.unit(name).row]
    if not others.size:
        return math.inf
    offset = world.pos[others] - point
    return float(np.sqrt((offset**2).sum(axis=1).min()))


def _regroup(world: World, spec: RegroupSpec) -> None:
    unit = world.catalog.unit(spec.unit)
    old = [slot for slot in world.units_of(spec.player).tolist() if world.type[slot] == unit.row]
    lives = [float(world.life[slot]) for slot in old]
    for slot in old:
        lifecycle.remove(world, slot)
    for i, place in enumerate(_spots(world, unit, spec.at, len(lives) + spec.more)):
        slot = lifecycle.spawn(world, unit, spec.player, (place[0], place[1]))
        if i < len(lives):
            world.life[slot] = lives[i]


def units_like(world: World, who: Who) -> Ints:
    """Return the slots of the living units in the world that fit, ascending."""
    slots = world.live
    if who.player is not None:
        slots = slots[world.owner[slots] == who.player]
    if who.unit is not None:
        slots = slots[world.type[slots] == world.catalog.unit(who.unit).row]
    return slots


# orders ---------------------------------------------------------------------------------------------------------------


def _order(world: World, spec: OrderSpec) -> None:
    slots = _addressees(world, spec)
    before = {slot: world.orders_of(slot) for slot in slots} if spec.queue == "front" else {}
    _command(world, spec, slots, queue=spec.queue == "append")
    for slot, orders in before.items():
        world.queue[slot] = [order for order in orders if order.ability]


def _addressees(world: World, spec: OrderSpec) -> list[int]:
    slots = world.units_of(spec.player)
    if spec.inside is not None:
        slots = slots[world.map.scenario.regions[spec.inside].covers(world.pos[slots])]
    if spec.group is not None:
        slots = slots[np.isin(world.tag[slots], world.script.groups.get(spec.group, []))]
    idle = [s for s in slots.tolist() if not (spec.idle and world.orders_of(s))]
    return [s for s in idle if _fits(world.unit_type(s), spec.unit, spec.unless)]


def _fits(unit: UnitType, name: str | None, unless: tuple[str, ...]) -> bool:
    traits = {"structure": unit.structure, "worker": unit.worker, "caster": unit.energy > 0.0, "flyer": unit.flying}
    return (name is None or unit.name == name) and not any(traits[trait] for trait in unless)


def _command(world: World, spec: OrderSpec, slots: list[int], *, queue: bool) -> None:
    if spec.attack_move is not None:
        commands.attack_move(world, slots, point_of(world, spec.attack_move), queue=queue)
    elif spec.move is not None:
        commands.move(world, slots, point_of(world, spec.move), queue=queue)
    elif spec.gather_near is not None:
        fields = melee_start.mineral_fields(world, point_of(world, spec.gather_near))
        if fields.size:
            commands.gather(world, slots, world.tag_of(int(fields[0])), queue=queue)
    elif spec.unload_at is not None:
        _unload(world, slots, point_of(world, spec.unload_at), queue=queue)
    elif spec.attack_units_of is not None:
        _attack_group(world, slots, world.units_of(spec.attack_units_of), queue=queue)
    elif spec.attack_nearest_of is not None:
        _attack_nearest(world, slots, world.units_of(spec.attack_nearest_of), queue=queue)


def _unload(world: World, slots: list[int], point: Point, *, queue: bool) -> None:
    """Make each transport among the slots unload every passenger at the point."""
    for slot in slots:
        card = world.catalog.cards[int(world.type[slot])]
        ability = next((ability for ability in card if ability.effect == "unload_all_at"), None)
        if ability is not None:
            casting.use(world, [slot], ability, point=point, queue=queue)


def _attack_group(world: World, slots: list[int], victims: Ints, *, queue: bool) -> None:
    """Make each of the slots attack every victim, in an order that chance draws."""
    for slot in slots:
        for rank, victim in enumerate(world.rng.permutation(victims).tolist()):
            commands.attack_unit(world, [slot], world.tag_of(victim), queue=queue or rank > 0)


def _attack_nearest(world: World, slots: list[int], victims: Ints, *, queue: bool) -> None:
    """Make each of the slots attack the nearest victim."""
    if not victims.size:
        return
    for slot in slots:
        offset = world.pos[victims] - world.pos[slot]
        nearest = int(victims[np.argmin(offset[:, 0] ** 2 + offset[:, 1] ** 2)])
        commands.attack_unit(world, [slot], world.tag_of(nearest), queue=queue)


# the rest -------------------------------------------------------------------------------------------------------------


def point_of(world: World, place: Any) -> Point:
    """Return the world coordinates of a named point (drawn ones included) or of a pair of numbers."""
    if isinstance(place, str):
        drawn = world.script.points.get(place)
        return world.map.scenario.points[place] if drawn is None else drawn
    x, y = place
    return _on_map(world, float(x), float(y))


def _spawn(world: World, names: tuple[str, ...]) -> None:
    for name in names:
        made = [slot for spec in world.map.scenario.groups[name] for slot in create(world, spec)]
        world.script.groups[name] = [world.tag_of(slot) for slot in made]


def _draw(world: World, options: tuple[dict[str, Any], ...]) -> None:
    option = options[int(world.rng.integers(len(options)))] if len(options) > 1 else options[0]
    for name, source in option.items():
        region = world.map.scenario.regions.get(source) if isinstance(source, str) else None
        world.script.points[name] = (
            point_of(world, source) if region is None else _on_map(world, *next(_points_in(world, region)))
        )


def _select(world: World, who: Who) -> None:
    slots = units_like(world, who)
    for player in sorted(set(world.owner[slots].tolist()) - {NEUTRAL}):
        tags = tuple(world.tag[slots[world.owner[slots] == player]].tolist())
        world.script.selections.append((player, tags))


def _score(world: World, added: dict[int, float]) -> None:
    for player, amount in added.items():
        if player < len(world.players):
            world.players[player].score.curriculum += amount


def _give(world: World, given: dict[int, Any]) -> None:
    for player, purse in given.items():
        if player < len(world.players):
            world.players[player].minerals += purse.minerals
            world.players[player].vespene += purse.vespene


_ACTIONS: Final[dict[type, Callable[[World, Any], object]]] = {
    Create: lambda world, action: create(world, action.create),
    SpawnGroups: lambda world, action: _spawn(world, action.spawn),
    Regroup: lambda world, action: _regroup(world, action.regroup),
    OrderUnits: lambda world, action: _order(world, action.order),
    Select: lambda world, action: _select(world, action.select),
    Draw: lambda world, action: _draw(world, action.draw),
    AddScore: lambda world, action: _score(world, action.score),
    Give: lambda world, action: _give(world, action.give),
    EndGame: lambda world, action: world.end({p: OUTCOMES[outcome] for p, outcome in action.result.items()}),
}
