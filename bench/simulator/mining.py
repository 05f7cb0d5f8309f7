"""Measure what workers, MULEs and geysers earn, beside what follows from distance, speed and acceleration.

Every row is measured on a melee base of the map, at both starts. A trip takes the time at the field, the wait after it
and two walks that begin and end at rest: ``2 * sqrt(way / acceleration)`` each, where the way is the distance of the
centres less both radii and the worker's body.
"""

from __future__ import annotations

import json
import math
import sys
from typing import TYPE_CHECKING

from bench.command_line import make_parser
from bench.tables import print_table
from khala_simulator.abilities import commands
from khala_simulator.combat import lifecycle
from khala_simulator.economy import melee_start
from khala_simulator.maps.game_map import load_map
from khala_simulator.tables.mechanics import MECHANICS
from khala_simulator.tick import advance, new_game
from khala_simulator.world.players import PlayerSetup

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_simulator.world.columns import Ints
    from khala_simulator.world.world import World

MINUTE = 1344
WARM_UP = MINUTE // 2
ENDLESS = 10**6
MULE_LIFE = 1440
WORKERS = (8, 12, 16, 20, 24, 32)
PLAYERS = (PlayerSetup(1, "terran", "agent"), PlayerSetup(2, "terran", "agent"))

Rows = dict[str, dict[str, float]]


def base(name: str, workers: Iterable[int] = (), kind: str = "SCV") -> World:
    """Return a melee game whose workers are one of ``kind`` for each of ``workers``, the rank of its field."""
    world = new_game(load_map(name), PLAYERS)
    for slot in world.live[[world.unit_type(slot).worker for slot in world.live.tolist()]].tolist():
        lifecycle.remove(world, slot)
    unit = world.catalog.unit(kind)
    for player in world.players[1:]:
        x, y = player.start or (0.0, 0.0)
        fields = melee_start.mineral_fields(world, (x, y))
        world.contents[fields] = ENDLESS
        for rank in workers:
            field = int(fields[rank % len(fields)])
            dx, dy = ((world.pos[field] - (x, y)) * 0.5).tolist()
            slot = lifecycle.spawn(world, unit, player.id, (x + dx, y + dy))
            commands.gather(world, [slot], world.tag_of(field))
    return world


def income(world: World, minutes: int) -> float:
    """Return the minerals a minute of the mean player, once its workers have found their rhythm."""
    advance(world, WARM_UP)
    before = minerals_of(world)
    advance(world, minutes * MINUTE)
    return (minerals_of(world) - before) / minutes


def minerals_of(world: World) -> float:
    """Return the minerals that the mean player has delivered."""
    players = world.players[1:]
    return sum(player.score.collected[0] for player in players) / len(players)


def fields_of(world: World) -> Ints:
    """Return the mineral fields of the first player's base, nearest first."""
    return melee_start.mineral_fields(world, world.players[1].start or (0.0, 0.0))


def expected_income(world: World, field: int) -> float:
    """Return the minerals a minute of one worker at a field, derived from its distance."""
    worker, hall = world.catalog.unit("SCV"), world.catalog.unit("CommandCenter")
    way = math.dist(world.pos[field].tolist(), world.players[1].start or (0.0, 0.0))
    way -= world.unit_type(field).radius_shown + hall.radius_shown + 2.0 * worker.radius
    acceleration, speed = worker.acceleration_n / 16.0**2, worker.speed_n / 16.0
    ramp = speed**2 / acceleration
    walk = 2.0 * math.sqrt(min(way, ramp) / acceleration) + max(way - ramp, 0.0) / speed
    trip = math.ceil(world.unit_type(field).harvest_loops) + MECHANICS.harvest_leaving + 2.0 * walk
    return 5.0 * MINUTE / trip


def lines(name: str, minutes: int) -> Rows:
    """Measure whole mineral lines."""
    return {f"{count} workers": {"a minute": income(base(name, range(count)), minutes)} for count in WORKERS}


def opening(name: str) -> Rows:
    """Measure the start of a game with its twelve workers and no others."""
    world = new_game(load_map(name), PLAYERS)
    marks: dict[str, float] = {}
    first = 0
    while world.loop < 2 * MINUTE:
        advance(world)
        first = first or (world.loop if minerals_of(world) else 0)
        if world.loop in (160, 320, 480, 640, MINUTE, 2 * MINUTE):
            marks[f"at {world.loop}"] = minerals_of(world)
    return {"opening": {"first return": first} | marks}


def fields(name: str, minutes: int) -> Rows:
    """Measure one, two and three workers at each field, and what one MULE takes from it in its life."""
    world = base(name)
    rows = {
        f"field {rank + 1}": {"expected": expected_income(world, slot)} for rank, slot in enumerate(fields_of(world))
    }
    for count in (1, 2, 3):
        world = base(name, list(range(len(rows))) * count)
        advance(world, WARM_UP)
        before = world.contents[fields_of(world)]
        advance(world, minutes * MINUTE)
        for row, taken in zip(rows.values(), before - world.contents[fields_of(world)], strict=True):
            row[f"workers: {count}"] = taken / minutes
    world = base(name, range(len(rows)), "MULE")
    advance(world, MULE_LIFE)
    for row, left in zip(rows.values(), world.contents[fields_of(world)], strict=True):
        row["MULE"] = float(ENDLESS - left)
    return rows


def main() -> None:
    parser = make_parser(__doc__)
    parser.add_argument("--map", default="Simple64", help="a melee map")
    parser.add_argument("--minutes", type=int, default=3, help="game minutes of each measurement")
    options = parser.parse_args()
    parts = lines(options.map, options.minutes), opening(options.map), fields(options.map, options.minutes)
    if options.json:
        json.dump({"command": " ".join(sys.argv), "rows": {key: row for part in parts for key, row in part.items()}},
                  sys.stdout)  # fmt: skip
        return
    for part in parts:
        rows = [(name, *(f"{value:.1f}" for value in row.values())) for name, row in part.items()]
        print_table(("", *next(iter(part.values()))), rows, title="minerals")
