"""Measure the cost of a picture of a battle on the simulator, from a snapshot to bytes.

A game is played for 40 decisions, all units attacking; then each picture is made of each of its snapshots, 512 pixels
large, with marks. `ms` is the median and `p95 ms` the 95th percentile of the time for one picture, with everything
that is new in a snapshot. `cpu ms` is the median of the thread's processor time, which is more reliable on a busy
machine. `first ms` is the first one of the map, whose ground is painted once. `units` is the largest number on the
screen. The aim is 5 ms.
"""

from __future__ import annotations

import dataclasses
import json
import statistics
import time
from typing import Any

from s2clientprotocol import raw_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from bench.command_line import make_parser
from bench.tables import print_table
from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.frames import CAMERA_WIDTH
from khala_bridge.knowledge import facts_of
from khala_bridge.names import unit_name
from khala_bridge.observe import Observer
from khala_bridge.observe.image.album import Album
from khala_bridge.state import Snapshot, read_info, read_snapshot
from khala_bridge.task.config import AgentConfig, TaskConfig, TeamConfig
from khala_bridge.task.images import ImageSpec
from khala_protocol.messages import Frames
from khala_simulator.process.client import Client, command, interface

BATTLES = {"2s3z": "llm_smac/2s3z", "2c_vs_64zg": "llm_smac/2c_vs_64zg", "pvz_task6": "llm_pysc2/pvz_task6_level1"}
PICTURES = {
    "screen, JPEG": ImageSpec(what="screen", max_teams=1, source="drawn"),
    "screen, PNG": ImageSpec(what="screen", max_teams=1, source="drawn", format="png"),
    "screen, WebP": ImageSpec(what="screen", max_teams=1, source="drawn", format="webp"),
    "minimap, JPEG": ImageSpec(what="minimap", source="drawn"),
    "features, JPEG": ImageSpec(what="features", max_teams=1, source="drawn"),
    "layer:buildable, JPEG": ImageSpec(what="layer:buildable", max_teams=1, source="drawn"),
}
DECISIONS, LOOPS = 40, 8
ATTACK = 3674


def play(map_name: str) -> list[Snapshot]:
    """Play a game in which all units attack the enemies, and return a snapshot per decision."""
    client = Client()
    seen = client.play(map_name, interface(), seed=1)
    info = read_info(client.ask(game_info=sc_pb.RequestGameInfo()).game_info, facts_of("multi"))
    snapshots = []
    for _ in range(DECISIONS):
        units = seen.observation.raw_data.units
        enemies = [unit.pos for unit in units if unit.alliance == raw_pb2.Enemy]
        if enemies:
            middle = (sum(p.x for p in enemies) / len(enemies), sum(p.y for p in enemies) / len(enemies))
            own = [unit.tag for unit in units if unit.alliance == raw_pb2.Self]
            client.act(command(ATTACK, own, point=middle))
        seen = client.step(LOOPS)
        snapshots.append(read_snapshot(seen, info))
        if seen.player_result:
            break
    return [shown for shown in snapshots if shown.own]


def task_of(shown: Snapshot, spec: ImageSpec) -> TaskConfig:
    """Return a task with one agent of all units that fight, and one picture."""
    types = tuple(dict.fromkeys(unit_name(unit.unit_type) for unit in shown.own))
    moves = {name: ("Move_Screen",) for name in types if catalogue()["Move_Screen"].fits(name)}
    team = TeamConfig(name="A", unit_types=tuple(moves), kind="select_all_type")
    agent = AgentConfig(name="A", role="", teams=(team,), actions=moves, images=(spec,), admits="any")
    return TaskConfig(name="bench", map="2s3z", task="", agents=(agent,))


def measure(snapshots: list[Snapshot], spec: ImageSpec) -> dict[str, Any]:
    task = task_of(snapshots[0], spec)
    observer = Observer(task.model_copy(update={"agents": (task.agents[0].model_copy(update={"images": ()}),)}))
    took_ms = []
    worked_ms = []
    sizes = []
    units = 0
    for shown in snapshots:
        seen = next(iter(observer.observe(shown).agents.values()))
        seen = dataclasses.replace(seen, agent=task.agents[0])
        began = time.perf_counter()
        worked = time.thread_time()
        pictures = Album(shown, shown.info.frame(Frames())).pictures(seen)
        took_ms.append(1000 * (time.perf_counter() - began))
        worked_ms.append(1000 * (time.thread_time() - worked))
        sizes += [len(picture.data) for picture in pictures]
        camera = seen.teams[0].camera if seen.teams else None
        if camera is not None:
            half = CAMERA_WIDTH / 2
            near = (u for u in shown.units.values() if max(abs(u.pos.x - camera.x), abs(u.pos.y - camera.y)) < half)
            units = max(units, sum(1 for _ in near))
    return {
        "units": units,
        "first ms": round(took_ms[0], 1),
        "ms": round(statistics.median(took_ms[1:]), 2),
        "p95 ms": round(statistics.quantiles(took_ms[1:], n=20)[-1], 2),
        "cpu ms": round(statistics.median(worked_ms[1:]), 2),
        "kB": round(statistics.mean(sizes) / 1000, 1),
    }


def main() -> None:
    given = make_parser(__doc__).parse_args()
    results = {}
    for battle, map_name in BATTLES.items():
        snapshots = play(map_name)
        results[battle] = {name: measure(snapshots, spec) for name, spec in PICTURES.items()}
    if given.json:
        print(json.dumps(results))
        return
    rows = [(battle, name, *row.values()) for battle, by_name in results.items() for name, row in by_name.items()]
    print_table(("battle", "picture", "units", "first ms", "ms", "p95 ms", "cpu ms", "kB"), rows, left=("picture",))
