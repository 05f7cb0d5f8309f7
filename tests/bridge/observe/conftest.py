"""A Protoss base and a fight before it, made by hand, and agents of every kind that see them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.catalogue.functions import functions, general
from khala_bridge.observe import Feedback, Observer
from khala_bridge.task.config import TaskConfig

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from s2clientprotocol import raw_pb2
    from s2clientprotocol import sc2api_pb2 as sc_pb

    from khala_bridge.state import Snapshot

    Make = Callable[..., raw_pb2.Unit]
    Snap = Callable[..., Snapshot]

SIDE = 64
"""Cells of the map, which is plain ground."""
NEXUS, GATEWAY, BUSY, PYLON, CORE = 0x100010001, 0x100020001, 0x100030001, 0x100040001, 0x100050001
WARPING, GATE = 0x100060001, 0x100070001
PROBE, IDLE_PROBE = 0x100110001, 0x100120001
STALKERS = (0x100210001, 0x100220001)
SENTRY = 0x100230001
FOES = (0x100310001, 0x100320001, 0x100330001)
FIELDS_AT: tuple[tuple[float, float], ...] = ((5, 14.5), (4, 16.5), (4, 18.5), (5, 20.5))
EXPANSION_AT: tuple[tuple[float, float], ...] = ((5, 44.5), (4, 46.5), (4, 48.5), (5, 50.5))
GEYSERS_AT = ((8.5, 10.5), (8.5, 40.5))

TASK: dict[str, Any] = {
    "name": "base",
    "own_map": {"file": "base.SC2Map", "race": "protoss", "opponent": "zerg"},
    "task": "Destroy all enemy structures.",
    "channels": ["Army"],
    "max_actions": 4,
    "agents": [
        {
            "name": "Commander",
            "kind": "commander",
            "role": "You lead the army.",
            "talks_to": ["Developer", "CombatGroup1"],
            "teams": [{"name": "All", "kind": "side", "actions": ["All_Units_Attack", "Zealot_Scan"]}],
        },
        {
            "name": "Developer",
            "kind": "developer",
            "role": "You develop the economy.",
            "talks_to": ["Commander"],
            "teams": [
                {
                    "name": "Empty",
                    "kind": "side",
                    "actions": [
                        *("Train_Probe", "Train_Stalker", "Train_Phoenix", "Warp_Zealot_Near", "Research_Blink"),
                        *("Build_Pylon", "Build_Forge"),
                    ],
                }
            ],
        },
        {
            "name": "Builder",
            "kind": "builder",
            "role": "You place structures.",
            "talks_to": ["Developer"],
            "teams": [{"name": "Builder-Probe", "unit_types": ["Probe"]}],
            "actions": {"Probe": ["Move_Minimap", "Build_Nexus_Near", "Build_Pylon_Screen", "Build_Stargate_Screen"]},
        },
        {
            "name": "CombatGroup1",
            "role": "You fight at the front.",
            "talks_to": ["Commander"],
            "teams": [
                {
                    "name": "Stalker-1",
                    "unit_types": ["Stalker"],
                    "task": "Stay alive.",
                    "stages": [{"task": "Go to [32, 32].", "at": [32, 32]}, {"task": "Hold [32, 32]."}],
                },
                {"name": "Sentry-1", "unit_types": ["Sentry"]},
            ],
            "actions": {
                "Stalker": ["Attack_Unit", "Move_Screen", "Ability_Blink_Screen", "Select_Unit_Blink_Screen"],
                "Sentry": ["Attack_Unit", "Ability_ForceField_Screen", "Ability_GuardianShield"],
            },
        },
    ],
}


@pytest.fixture
def base_task() -> TaskConfig:
    """Return four agents, one of each kind."""
    return TaskConfig.model_validate(TASK)


def able(*names: str) -> frozenset[int]:
    """Return the abilities of some functions of PySC2, as a snapshot has them."""
    numbers = [functions()[name].ability_id for name in names]
    return frozenset((*numbers, *map(general, numbers)))


BASIC = able("Attack_screen", "Move_screen")
ABILITIES: dict[int, frozenset[int]] = {
    NEXUS: able("Train_Probe_quick"),
    GATEWAY: able("Train_Stalker_quick", "Train_Zealot_quick"),
    BUSY: able("Train_Stalker_quick", "Train_Zealot_quick"),
    GATE: able("TrainWarp_Zealot_screen"),
    PROBE: BASIC | able("Build_Pylon_screen", "Build_Forge_screen"),
    IDLE_PROBE: BASIC | able("Build_Pylon_screen", "Build_Forge_screen"),
    STALKERS[0]: BASIC | able("Effect_Blink_screen"),
    STALKERS[1]: BASIC,
    SENTRY: BASIC | able("Effect_ForceField_screen"),
}


@pytest.fixture
def base(unit: Make) -> Callable[..., list[raw_pb2.Unit]]:
    """Return the units of a base and of a fight before it."""

    def make(*, earlier: bool = False) -> list[raw_pb2.Unit]:
        return [*_structures(unit, earlier=earlier), *_army(unit, earlier=earlier), *_resources(unit)]

    return make


def _structures(unit: Make, *, earlier: bool) -> Iterable[raw_pb2.Unit]:
    nexus = unit(NEXUS, "Nexus", 11.5, 17.5, energy=50, energy_max=200, is_powered=True)
    nexus.assigned_harvesters, nexus.ideal_harvesters = 14, 16
    nexus.orders.add(ability_id=functions()["Train_Probe_quick"].ability_id, progress=0.4)
    yield nexus
    yield unit(GATEWAY, "Gateway", 18.5, 14.5, is_powered=True)
    busy = unit(BUSY, "Gateway", 18.5, 20.5, is_powered=True)
    busy.orders.add(ability_id=functions()["Train_Stalker_quick"].ability_id, progress=0.25)
    busy.orders.add(ability_id=functions()["Train_Zealot_quick"].ability_id)
    yield busy
    yield unit(PYLON, "Pylon", 18, 17.5)
    yield unit(CORE, "CyberneticsCore", 40.5, 14.5)
    yield unit(GATE, "WarpGate", 22.5, 17.5, is_powered=True)
    if not earlier:
        yield unit(WARPING, "Stargate", 22.5, 14.5, build_progress=0.35)


def _army(unit: Make, *, earlier: bool) -> Iterable[raw_pb2.Unit]:
    probe = unit(PROBE, "Probe", 8, 17)
    probe.orders.add(ability_id=functions()["Harvest_Gather_screen"].ability_id, target_unit_tag=0x100910001)
    yield probe
    yield unit(IDLE_PROBE, "Probe", 10, 20)
    first = unit(STALKERS[0], "Stalker", 30, 17, health=80 if earlier else 43, shield=0, weapon_cooldown=11.2)
    first.orders.add(ability_id=functions()["Attack_screen"].ability_id, target_unit_tag=FOES[0])
    yield first
    second = unit(STALKERS[1], "Stalker", 30, 19, cloak=1)
    place = second.orders.add(ability_id=functions()["Move_screen"].ability_id).target_world_space_pos
    place.x, place.y = 33, 20
    yield second
    yield unit(SENTRY, "Sentry", 28, 18, energy=62.5, energy_max=200)
    yield unit(FOES[0], "Roach", 34, 17, alliance="enemy", health=100)
    yield unit(FOES[1], "Zergling", 32, 18, alliance="enemy")
    if earlier:
        yield unit(FOES[2], "Zergling", 33, 18, alliance="enemy")


def _resources(unit: Make) -> Iterable[raw_pb2.Unit]:
    for number, (x, y) in enumerate(FIELDS_AT + EXPANSION_AT):
        yield unit(0x100910001 + 0x10000 * number, "MineralField", x, y, alliance="neutral", mineral_contents=1800)
    for number, (x, y) in enumerate(GEYSERS_AT):
        tag = 0x100A10001 + 0x10000 * number
        yield unit(tag, "VespeneGeyser", x, y, alliance="neutral", vespene_contents=2250)


@pytest.fixture
def look(snapshot: Snap, plain: Any) -> Callable[..., Snapshot]:
    """Return a snapshot of units on plain ground, with power and abilities."""

    def make(
        units: list[raw_pb2.Unit], *, loop: int = 4480, alerts: Sequence[sc_pb.Alert.ValueType] = (), **fields: Any
    ) -> Snapshot:
        player = {"minerals": 150, "vespene": 75, "food_used": 21, "food_cap": 23, "food_workers": 14}
        given: dict[str, Any] = {"abilities": ABILITIES, "player": player, **fields}

        def change(response: sc_pb.ResponseObservation, info: sc_pb.ResponseGameInfo) -> None:
            plain(response, info)
            for unit in units:
                if unit.tag == PYLON:
                    source = response.observation.raw_data.player.power_sources.add(tag=PYLON, radius=6.5)
                    source.pos.CopyFrom(unit.pos)
            response.observation.alerts.extend(alerts)

        return snapshot(units, loop=loop, size=(SIDE, SIDE), change=change, **given)

    return make


@pytest.fixture
def pages(base: Any, look: Any, base_task: TaskConfig) -> Callable[..., dict[str, str]]:
    """Return the pages of the base's agents at its second observation, by agent."""

    def write(feedback: Mapping[str, Feedback] | None = None, **limits: int) -> dict[str, str]:
        agents = tuple(a.model_copy(update={"text_tokens": limits.get(a.name)}) for a in base_task.agents)
        observer = Observer(base_task.model_copy(update={"agents": agents}))
        tuple(observer.observe(look(base(earlier=True), loop=4464, upgrades=())).agents.values())
        observation = observer.observe(look(base(), upgrades=(87,), dead=frozenset({FOES[2]})), feedback)
        return {name: agent.text for name, agent in observation.agents.items()}

    return write
