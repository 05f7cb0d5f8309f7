"""Measure the processor time of a rendered frame of the screen and of the minimap, while two armies fight.

Two armies of several types meet in the middle of an open map, all of them in the camera's view; each loop is painted.
The first frame, in which the ground and every look are painted for the first time, is reported separately.
"""

from __future__ import annotations

import json
import resource
import statistics
import sys
import time
from typing import TYPE_CHECKING

from s2clientprotocol import common_pb2, debug_pb2
from s2clientprotocol import sc2api_pb2 as sc

from bench.command_line import make_parser
from bench.tables import print_table
from khala_simulator.api.game import HostedGame, Setup
from khala_simulator.api.layers import Frame
from khala_simulator.maps.game_map import load_map

if TYPE_CHECKING:
    from khala_simulator.api.seat import PlayerSeat

SIZES = (128, 256, 512, 1024)
MINIMAP = 128
FRAMES = 200
ARMY = ("Marine", "Marauder", "Stalker", "Zealot", "Roach", "Zergling", "Hydralisk", "Colossus", "VoidRay", "Mutalisk")


def stage(screen: int, units: int) -> tuple[HostedGame, PlayerSeat]:
    """Return a game in which `units` units face each other in view."""
    players = (sc.PlayerSetup(type=sc.Participant, race=common_pb2.Protoss), sc.PlayerSetup(type=sc.Computer))
    game = HostedGame(
        Setup(load_map("llm_smac/3s_vs_3z"), b"", "bench", players, 1, disable_fog=False, realtime=False), "4.10"
    )
    size = common_pb2.Size2DI(x=screen, y=screen)
    small = common_pb2.Size2DI(x=MINIMAP, y=MINIMAP)
    setup = sc.SpatialCameraSetup(resolution=size, minimap_resolution=small, width=24)
    seat = game.sit(1, sc.InterfaceOptions(raw=True, render=setup))
    catalog = game.catalog
    for k in range(units):
        owner, row = 1 + k % 2, k // 2
        pos = common_pb2.Point2D(x=(11 if owner == 1 else 21) + row % 3 - 1, y=7 + row % 19)
        create = debug_pb2.DebugCreateUnit(unit_type=catalog.unit(ARMY[row % len(ARMY)]).id, owner=owner, pos=pos)
        game.debug(1, debug_pb2.DebugCommand(create_unit=create))
    game.step(1)
    return game, seat


def frame(game: HostedGame, seat: PlayerSeat) -> Frame:
    """Return what the seat sees now."""
    sight = seat.look()
    chosen = seat.selection.rows(sight)
    return Frame(game.world, game.types, 1, sight, chosen, seat.camera, sight.pos[:0], game.world.fog)


def measure(screen: int, units: int) -> dict[str, float]:
    """Return the milliseconds of CPU per frame."""
    game, seat = stage(screen, units)
    assert seat.renders is not None
    spent: dict[str, list[float]] = {"screen": [], "minimap": []}
    shown = []
    for _ in range(FRAMES):
        game.step(1)
        now = frame(game, seat)
        for name, paint in (("screen", seat.renders.screen), ("minimap", seat.renders.minimap)):
            start = time.process_time()
            paint(now)
            spent[name].append((time.process_time() - start) * 1e3)
        shown.append(len(now.sight))
    times = spent["screen"]
    return {
        "screen_px": screen,
        "units_first": shown[0],
        "units_last": shown[-1],
        "first_ms": times[0],
        "screen_ms": statistics.median(times[1:]),
        "screen_p95_ms": statistics.quantiles(times[1:], n=20)[-1],
        "minimap_ms": statistics.median(spent["minimap"][1:]),
    }


def main() -> None:
    """Print the figures."""
    parser = make_parser(__doc__)
    parser.add_argument("--units", type=int, default=80, help="units at the start; some die")
    arguments = parser.parse_args()
    results = [measure(size, arguments.units) for size in SIZES]
    memory_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    if arguments.json:
        sys.stdout.write(json.dumps({"results": results, "memory_mb": memory_mb}) + "\n")
        return
    print_table(
        ("screen", "units", "CPU ms per frame", "95 %", "first frame", "minimap ms"),
        [
            (f"{row['screen_px']:.0f}", f"{row['units_first']:.0f} to {row['units_last']:.0f}",
             *(f"{row[key]:.2f}" for key in ("screen_ms", "screen_p95_ms", "first_ms", "minimap_ms")))
            for row in results
        ],
    )  # fmt: skip
    print(f"largest memory of the process: {memory_mb:.0f} MB")
