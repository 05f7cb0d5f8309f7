"""What players are shown in games with random orders: digests that are recorded once and must hold.

``python -m tests.simulator.api.recorded --write`` records them again, after a change of the rules or of what is shown
that is meant. Digests are cut to 16 digits: chance makes one of 10^19 pairs equal.
"""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import json
import random
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.api import ui
from khala_simulator.api.effects import seen_buffs
from khala_simulator.api.layers import Frame
from khala_simulator.api.raw import PerceivedUnits
from khala_simulator.api.seat import PlayerSeat
from khala_simulator.api.types import types_of
from khala_simulator.combat import lifecycle
from khala_simulator.maps.game_map import load_map
from khala_simulator.tick import advance, new_game
from tests.simulator.engine.random_orders import give_orders

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from khala_simulator.api.sight import Sight
    from khala_simulator.world.world import World

FILE: Final = Path(__file__).with_name("recorded.json")
GAMES: Final = (
    "llm_pysc2/pvz_task8_level1", "melee/Simple64", "llm_smac/MMM2", "mini_games/BuildMarines",
    "llm_pysc2/pvz_task6_level1",
)  # fmt: skip
LOOPS: Final = 800
EVERY: Final = 80


def game(name: str, loops: int = LOOPS) -> Iterator[World]:
    """Yield a world after every eight loops of a game with random orders, in which every order is possible."""
    world, chance = new_game(load_map(name), seed=3), random.Random(3)
    for player in world.players[1:]:
        player.cheats += ["tech_tree", "cooldown", "food"]
        player.minerals = player.vespene = 5000.0
    x, y = world.pos[world.units_of(1)[0]].tolist()  # near it what such games have not: a detector, and an add-on
    for kind in ("Observer", "Barracks", "BarracksTechLab"):
        lifecycle.spawn(world, world.catalog.unit(kind), 1, (x, y))
    world.addon[world.units_of(1)[-2]] = world.units_of(1)[-1]
    while world.loop < loops and not world.ended:
        give_orders(world, chance)
        advance(world, 8)
        yield world


def seats_of(world: World) -> list[PlayerSeat]:
    """Return an interface for an observer and for each player; they differ in what they ask for."""
    types = types_of(world.catalog)
    sizes = ((128, 64), (40, 21), (64, 33))
    return [
        PlayerSeat(
            world,
            types,
            player,
            sc.InterfaceOptions(
                raw=True,
                show_cloaked=player != 1,
                show_placeholders=player != 0,
                feature_layer=sc.SpatialCameraSetup(
                    width=24,
                    resolution=common_pb2.Size2DI(x=screen, y=screen),
                    minimap_resolution=common_pb2.Size2DI(x=minimap, y=minimap + 2),
                    allow_cheating_layers=player == 2,
                ),
            ),
        )
        for player, (screen, minimap) in zip(range(len(world.players)), sizes, strict=False)
    ]


def units_of(seat: PlayerSeat, sight: Sight) -> PerceivedUnits:
    """Return the units of a sight for raw data; every second one is selected."""
    half = np.arange(len(sight)) % 2 == 0
    return PerceivedUnits(
        seat.world, seat.types, sight, half, ~half, (1.5, 2.25), seen_buffs(seat.world, sight), seat.player
    )


def shown(seat: PlayerSeat, *, through_fog: bool) -> dict[str, bytes]:
    """Return what a player perceives, as bytes: the columns, the units, the feature layers, panels of selections."""
    world = seat.world
    sight = seat.look(through_fog=through_fog)
    columns = [getattr(sight, field.name) for field in dataclasses.fields(sight)]
    units = units_of(seat, sight)
    if len(sight):
        seat.move_camera(*sight.pos[world.loop // 8 % len(sight)].tolist())
    frame = Frame(world, seat.types, seat.player, sight, units.selected, seat.camera, sight.pos[:2], not through_fog)
    assert seat.layers is not None
    tags = world.tag[world.live].tolist()
    panels = []
    for chosen in (tags, *([tag] for tag in tags)):
        seat.selection.choose(chosen)
        panels.append(ui.panel(world, seat.types, seat.selection, seat.player).SerializeToString())
    return {
        "sight": b"".join(map(_as_sent, columns)),
        "units": units.encode(),
        "layers": b"".join(seat.layers.encode(frame)),
        "panels": b"".join(panels),
    }


def _as_sent(column: NDArray[Any]) -> bytes:
    """Return a column as bytes, floats in the precision of the API: an angle's last bits depend on the processor."""
    sent = column.astype(np.float32) if column.dtype.kind == "f" else column
    return str(sent.dtype).encode() + sent.tobytes()


def digests(name: str, loops: int = LOOPS) -> list[dict[str, str]]:
    """Return the digests of all that was shown in a game, for every 80 loops."""
    found: list[dict[str, str]] = []
    seats: list[PlayerSeat] = []
    parts: dict[str, hashlib._Hash] = {}
    for world in game(name, loops):
        seats = seats or seats_of(world)
        for seat in seats:
            for through_fog in (False, True):
                for part, data in shown(seat, through_fog=through_fog).items():
                    parts.setdefault(part, hashlib.sha256()).update(data)
        if world.loop % EVERY == 0:
            found.append({part: sha.hexdigest()[:16] for part, sha in parts.items()})
    return found


def recorded(name: str, loops: int = LOOPS) -> list[dict[str, str]]:
    """Return the recorded digests of so many loops of a game."""
    found: list[dict[str, str]] = json.loads(FILE.read_text(encoding="utf-8"))[name]
    return found[: loops // EVERY]


def main() -> None:
    """Write the record, or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="record what is shown now")
    parser.add_argument("--loops", type=int, default=LOOPS, help="of the games, to compare fewer")
    given = parser.parse_args()
    if given.write:
        FILE.write_text(json.dumps({name: digests(name) for name in GAMES}, indent=0) + "\n", encoding="utf-8")
        return
    for name in GAMES:
        then = recorded(name, given.loops)
        pairs = zip(digests(name, given.loops), then, strict=False)
        parted = next(((count, now, old) for count, (now, old) in enumerate(pairs) if now != old), None)
        if parted is None:
            print(f"{name}: the same")  # noqa: T201  # a command's output
        else:
            count, now, old = parted
            print(f"{name}: {[part for part in now if now[part] != old[part]]} differ after loop {EVERY * count}")  # noqa: T201  # see above


if __name__ == "__main__":
    main()
