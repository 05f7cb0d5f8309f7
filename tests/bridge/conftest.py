"""Games without a game: units, snapshots and tasks made by hand, and golden files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from s2clientprotocol import common_pb2, raw_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.knowledge import facts_of, knowledge
from khala_bridge.state import Snapshot, read_info, read_snapshot
from khala_bridge.task.config import TaskConfig
from khala_bridge.task.maps import known_maps
from khala_bridge.task.standard import standard_task
from khala_protocol.configfile import load

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from khala_bridge.knowledge import DataSet

    Change = Callable[[sc_pb.ResponseObservation, sc_pb.ResponseGameInfo], None]

GOLDEN = Path(__file__).parent / "golden"
TASKS = Path(__file__).resolve().parents[2] / "configs" / "tasks"


def make_unit(tag: int, name: str, x: float, y: float, **fields: Any) -> raw_pb2.Unit:
    """Return an own unit at full health, with the given changes."""
    known = knowledge().get(name)
    alliance = {"own": raw_pb2.Self, "ally": raw_pb2.Ally, "enemy": raw_pb2.Enemy, "neutral": raw_pb2.Neutral}
    unit = raw_pb2.Unit(
        tag=tag,
        unit_type=known.id if known else fields.pop("unit_type"),
        alliance=alliance[fields.pop("alliance", "own")],
        display_type=raw_pb2.Visible,
        cloak=raw_pb2.NotCloaked,
        health=known.health if known else 1,
        health_max=known.health if known else 1,
        shield=known.shield if known else 0,
        shield_max=known.shield if known else 0,
        build_progress=1.0,
    )
    unit.pos.x, unit.pos.y, unit.pos.z = x, y, 10.0
    orders = fields.pop("orders", ())
    for name_, value in fields.items():
        if isinstance(value, tuple):
            getattr(unit, name_).extend(value)
        else:
            setattr(unit, name_, value)
    for ability in orders:
        unit.orders.add(ability_id=ability)
    return unit


def make_snapshot(
    units: Iterable[raw_pb2.Unit],
    *,
    loop: int = 224,
    size: tuple[int, int] = (32, 32),
    camera: tuple[float, float] = (16, 16),
    upgrades: Iterable[int] = (),
    player: dict[str, int] | None = None,
    errors: Iterable[sc_pb.ActionError] = (),
    change: Change | None = None,
    data: DataSet = "multi",
    **fields: Any,
) -> Snapshot:
    """Return a snapshot: these units on a map of this size that depends on these data.

    `change` may edit the messages before they are read.
    """
    response = sc_pb.ResponseObservation()
    observation = response.observation
    observation.game_loop = loop
    observation.player_common.player_id = 1
    for name, value in (player or {}).items():
        setattr(observation.player_common, name, value)
    observation.raw_data.units.extend(units)
    observation.raw_data.player.upgrade_ids.extend(upgrades)
    observation.raw_data.player.camera.x, observation.raw_data.player.camera.y = camera
    info = sc_pb.ResponseGameInfo()
    info.start_raw.map_size.x, info.start_raw.map_size.y = size
    info.start_raw.playable_area.p1.x, info.start_raw.playable_area.p1.y = size
    layers = info.options.feature_layer
    layers.width = 24
    layers.resolution.x = layers.resolution.y = 128
    layers.minimap_resolution.x = layers.minimap_resolution.y = 64
    response.action_errors.extend(errors)
    if change is not None:
        change(response, info)
    return read_snapshot(response, read_info(info, facts_of(data)), **fields)


def make_plain(response: sc_pb.ResponseObservation, info: sc_pb.ResponseGameInfo) -> None:
    """Make the whole map one walkable and buildable plain."""
    del response
    ground, size = info.start_raw, common_pb2.Size2DI(x=info.start_raw.map_size.x, y=info.start_raw.map_size.y)
    for grid, bits, value in (
        (ground.placement_grid, 1, b"\xff"),
        (ground.pathing_grid, 1, b"\xff"),
        (ground.terrain_height, 8, b"\x80"),
    ):
        data = value * (size.x * size.y * bits // 8)
        grid.CopyFrom(common_pb2.ImageData(bits_per_pixel=bits, size=size, data=data))


@pytest.fixture(scope="session")
def plain() -> Change:
    """Return a change of a snapshot that makes the whole map one walkable and buildable plain."""
    return make_plain


@pytest.fixture
def unit() -> Callable[..., raw_pb2.Unit]:
    return make_unit


@pytest.fixture
def snapshot() -> Callable[..., Snapshot]:
    return make_snapshot


@pytest.fixture(scope="session")
def task() -> Callable[..., TaskConfig]:
    """Return a shipped task by name, or the standard task of a map, with the given changes."""

    def get(name: str = "2s3z", **changed: Any) -> TaskConfig:
        file = TASKS / "llm_smac" / f"{name}.yaml"
        found = load(file, TaskConfig) if file.exists() else standard_task(known_maps()[name])
        return found.model_copy(update=changed)

    return get


@pytest.fixture
def golden() -> Callable[[str, str], None]:
    """Compare a text with a golden file; `GOLDEN=write` in the environment writes the file instead."""

    def check(name: str, text: str) -> None:
        path = GOLDEN / name
        if os.environ.get("GOLDEN") == "write":
            path.write_text(text, encoding="utf-8")
        assert text == path.read_text(encoding="utf-8")

    return check


@pytest.fixture
def battle() -> list[raw_pb2.Unit]:
    """Return a snapshot of 2s3z in the middle of its fight, which leads to every kind of line in a text."""
    return [
        make_unit(0x100040001, "Stalker", 10, 16, weapon_cooldown=14.0, orders=(3674,)),
        make_unit(0x100080001, "Stalker", 11.5, 17, health=61, shield=0, energy=0),
        make_unit(0x1000C0001, "Zealot", 14, 16, shield=12.4),
        make_unit(0x100100001, "Zealot", 14.5, 15),
        make_unit(0x100140001, "Zealot", 31, 2, buff_ids=(5,)),
        make_unit(0x100180001, "Zealot", 15, 16.5, alliance="enemy", shield=0, health=0.4),
        make_unit(0x1001C0001, "Zealot", 15.2, 15, alliance="enemy", cloak=raw_pb2.CloakedDetected),
        make_unit(0x100200001, "Stalker", 20, 16, alliance="enemy", is_hallucination=True),
        make_unit(0x100240001, "MineralField", 12, 12, alliance="neutral", unit_type=341),
    ]


@pytest.fixture
def tasks_dir() -> Path:
    return TASKS


TEAMS = {  # table D3 of the paper: how many units each team has to begin with
    "2s3z": {"Zealot-1": 2, "Zealot-2": 1, "Stalker-1": 2},
    "3s5z": {"Zealot-1": 2, "Zealot-2": 2, "Zealot-3": 1, "Stalker-1": 3},
    "1c3s5z": {"Zealot-1": 2, "Zealot-2": 2, "Zealot-3": 1, "Stalker-1": 3, "Colossus-1": 1},
    "3s5z_vs_3s6z": {"Zealot-1": 2, "Zealot-2": 2, "Zealot-3": 1, "Stalker-1": 3},
    "2c_vs_64zg": {"Colossus-1": 1, "Colossus-2": 1},
    "2s_vs_1sc": {"Stalker-1": 1, "Stalker-2": 1},
    "3s_vs_3z": {"Stalker-1": 3},
    "3s_vs_4z": {"Stalker-1": 3},
    "3s_vs_5z": {"Stalker-1": 3},
}


@pytest.fixture
def paper_teams() -> dict[str, dict[str, int]]:
    """Return the initial number of units of each team, by task and team."""
    return TEAMS
