"""Text for agents that lead or build a side: counts, alerts, events, other agents' teams, landmarks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.catalogue.functions import functions
from khala_bridge.observe import Observer
from khala_protocol.messages import Alert, EnemyCount, Production, TypeCount

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.state import Snapshot
    from khala_protocol.messages import View


@pytest.fixture
def views(base_task: Any) -> Callable[..., list[View]]:
    """Return the views of an agent, snapshot after snapshot."""

    def see(agent: str, *snapshots: Snapshot) -> list[View]:
        observer = Observer(base_task)
        return [observer.observe(snapshot).agents[agent].view for snapshot in snapshots]

    return see


# --- counts ---------------------------------------------------------------------------------------------------


def test_idle_and_unfinished_units_are_counted(unit: Any, look: Any, views: Any) -> None:
    probe = unit(1, "Probe", 8, 8, orders=(functions()["Harvest_Gather_screen"].ability_id,))
    units = [
        probe,
        unit(2, "Probe", 9, 8),
        *(unit(10 + n, "Zealot", 9, 9, build_progress=progress) for n, progress in enumerate((0.25, 0.5, 1.0))),
        unit(20, "Gateway", 20, 20),
        unit(21, "Pylon", 24, 24),
    ]
    (view,) = views("Developer", look(units))
    assert view.counts.units == (
        TypeCount(type="Probe", ready=2, idle=1),
        TypeCount(type="Zealot", ready=1, under_way=(0.5, 0.25)),
    )
    assert view.counts.structures == (
        TypeCount(type="Gateway", ready=1, idle=1),
        TypeCount(type="Pylon", ready=1),
    )


def test_production_is_told_with_progress_and_queue(unit: Any, look: Any, views: Any) -> None:
    gateways = [unit(tag, "Gateway", 20, 10 * tag) for tag in (1, 2)]
    train = functions()["Train_Zealot_quick"].ability_id
    for gateway, progress in zip(gateways, (0.25, 0.75), strict=True):
        gateway.orders.add(ability_id=train, progress=progress)
    gateways[0].orders.add(ability_id=train)
    (view,) = views("Developer", look(gateways))
    assert view.counts.production == (Production(order="Train_Zealot", progress=(0.75, 0.25), queued=1),)


def test_enemies_are_remembered_until_they_die(unit: Any, look: Any, views: Any) -> None:
    eyes = unit(1, "Stalker", 30, 30)
    foes = [unit(tag, "Roach", 30, tag, alliance="enemy") for tag in (31, 32, 33)]
    seen = [look([eyes, *foes]), look([eyes, foes[2]]), look([eyes], dead=frozenset({33}))]
    counted = [view.counts.enemies for view in views("Commander", *seen)]
    assert counted == [
        (EnemyCount(type="Roach", seen=3, in_sight=3, minimap=(30, 33)),),
        (EnemyCount(type="Roach", seen=3, in_sight=1, minimap=(30, 31)),),
        (EnemyCount(type="Roach", seen=3, in_sight=0, dead=1, minimap=(30, 33)),),
    ]


def test_what_is_no_army_is_no_enemy_that_was_spotted(unit: Any, look: Any, views: Any) -> None:
    foes = [
        unit(2, "Broodling", 30, 31, alliance="enemy"),
        unit(3, "Larva", 30, 31, alliance="enemy"),
        unit(4, "Zealot", 30, 32, alliance="enemy", is_hallucination=True),
    ]
    (view,) = views("Commander", look([unit(1, "Stalker", 30, 30), *foes]))
    assert view.counts.enemies == ()


def test_a_new_episode_has_seen_no_enemy(unit: Any, look: Any, base_task: Any) -> None:
    observer = Observer(base_task)
    eyes = unit(1, "Stalker", 30, 30)
    observer.observe(look([eyes, unit(2, "Roach", 30, 31, alliance="enemy")]))
    observer.begin()
    counts = observer.observe(look([eyes])).agents["Commander"].view.counts
    assert counts is not None
    assert counts.enemies == ()


# --- events and alerts ----------------------------------------------------------------------------------------


def test_what_happened_to_the_side_is_told(unit: Any, look: Any, views: Any) -> None:
    before = [unit(1, "Gateway", 20, 20, build_progress=0.9), unit(2, "Zealot", 8, 8)]
    now = [unit(1, "Gateway", 20, 20), unit(3, "Roach", 9, 9, alliance="enemy")]
    *_, view = views("Developer", look(before), look(now, upgrades=(87,), dead=frozenset({2})))
    assert [(e.what, e.alliance, e.type) for e in view.events] == [
        ("finished", "own", "Gateway"),
        ("researched", "own", "Blink"),
        ("died", "own", "Zealot"),
        ("appeared", "enemy", "Roach"),
    ]


def test_who_comes_back_from_a_geyser_is_not_new(unit: Any, look: Any, views: Any) -> None:
    hall, probe = unit(1, "Nexus", 10, 10), unit(2, "Probe", 14, 10)
    *_, inside, back = views("Developer", look([hall, probe]), look([hall]), look([hall, probe]))
    assert (inside.events, back.events) == ((), ())


def test_a_worker_that_becomes_a_structure_is_new_once(unit: Any, look: Any, views: Any) -> None:
    growing = unit(2, "SpawningPool", 14, 10, build_progress=0.5)
    drone, pool = unit(2, "Drone", 14, 10), unit(2, "SpawningPool", 14, 10)
    *_, done, later = views("Developer", *map(look, ([drone], [growing], [pool], [pool])))
    assert [(event.what, event.type) for event in (*done.events, *later.events)] == [("finished", "SpawningPool")]


def test_nothing_has_happened_at_the_first_observation(base: Any, look: Any, views: Any) -> None:
    (view,) = views("Developer", look(base()))
    assert view.events == ()


def test_losses_near_each_other_are_one_alert(unit: Any, look: Any, views: Any) -> None:
    def army(health: float) -> list[Any]:
        return [
            unit(1, "Zealot", 10, 10, health=health),
            unit(2, "Zealot", 14, 10, health=health),
            unit(3, "Pylon", 40, 40, health=2 * health),
            unit(4, "Probe", 60, 8),
        ]

    *_, view = views("Commander", look([*army(80), unit(5, "Stalker", 12, 10)]), look(army(50), dead=frozenset({5})))
    assert view.alerts == (
        Alert(minimap=(12, 54), units={"Stalker": 1, "Zealot": 2}, lost=60, died=1),
        Alert(minimap=(40, 24), units={"Pylon": 1}, lost=60),
    )


def test_who_recovers_raises_no_alert(unit: Any, look: Any, views: Any) -> None:
    *_, view = views("Commander", *(look([unit(1, "Zealot", 10, 10, shield=shield)]) for shield in (10, 30)))
    assert view.alerts == ()


def test_the_games_own_warnings_are_passed_on(unit: Any, look: Any, base_task: Any) -> None:
    alerts = (sc_pb.NuclearLaunchDetected, sc_pb.TrainUnitComplete, sc_pb.NuclearLaunchDetected)
    snapshot = look([unit(1, "Zealot", 10, 10)], alerts=alerts)
    text = Observer(base_task).observe(snapshot).agents["Commander"].text
    assert "\nAlerts\n    NuclearLaunchDetected\n\n" in text


# --- others ---------------------------------------------------------------------------------------------------


def test_a_commander_hears_of_the_teams_of_the_others(unit: Any, look: Any, views: Any) -> None:
    units = [unit(1, "Stalker", 10, 10, shield=0), unit(2, "Stalker", 12, 10), unit(3, "Probe", 30, 30)]
    (view,) = views("Commander", look(units))
    told = [(team.agent, team.name, team.minimap, team.units, team.health) for team in view.others]
    assert told == [
        ("Builder", "Builder-Probe", (30, 34), {"Probe": 1}, 1.0),
        ("CombatGroup1", "Stalker-1", (10, 54), {"Stalker": 2}, 0.75),
    ]


# --- landmarks ------------------------------------------------------------------------------------------------


def marks(view: View, what: str) -> list[tuple[str, str]]:
    return [(mark.type, mark.about) for mark in view.landmarks if mark.what == what]


def test_free_places_are_named_by_the_resource_beside_them(base: Any, look: Any, views: Any) -> None:
    (view,) = views("Builder", look(base()))
    (place,) = (mark for mark in view.landmarks if mark.what == "base place")
    fields = {hex(u.tag): (u.pos.x, 64 - u.pos.y) for u in base() if u.mineral_contents}
    apart = {tag: abs(x - place.minimap[0]) + abs(y - place.minimap[1]) for tag, (x, y) in fields.items()}
    assert apart[place.tag] < 12
    assert marks(view, "geyser") == [("VespeneGeyser", "by your Nexus 0x100010001")]
    assert marks(view, "power field") == [("Pylon", "radius 6.5, warps in fast")]


def test_a_place_is_free_until_somebody_builds_there(base: Any, unit: Any, look: Any, views: Any) -> None:
    (free,) = views("Builder", look(base()))
    (place,) = (mark for mark in free.landmarks if mark.what == "base place")
    taken = unit(0x500, "Hatchery", place.minimap[0], 64 - place.minimap[1], alliance="enemy")
    used = unit(0x501, "Assimilator", 8.5, 10.5)
    (view,) = views("Builder", look([*base(), taken, used]))
    assert marks(view, "base place") == marks(view, "geyser") == []


def test_a_power_field_without_room_says_so(unit: Any, look: Any, views: Any) -> None:
    crowd = [unit(0x600 + n, "Zealot", 11 + n % 15, 10.5 + n // 15, radius=1.0) for n in range(15 * 15)]
    (view,) = views("Developer", look([unit(0x100040001, "Pylon", 18, 17.5), *crowd]))
    assert marks(view, "power field") == [("Pylon", "radius 6.5, no room for a unit")]


def test_what_workers_are_on_their_way_to_build_is_told(unit: Any, look: Any, base_task: Any) -> None:
    probe = unit(1, "Probe", 16, 16)
    for x in (30, 34):
        place = probe.orders.add(ability_id=functions()["Build_Pylon_screen"].ability_id).target_world_space_pos
        place.x, place.y = x, 30
    developer = Observer(base_task).observe(look([probe])).agents["Developer"]
    assert developer.view.counts is not None
    assert developer.view.counts.planned == {"Pylon": 2}
    assert "    Going to be built by workers on their way: 2 Pylon\n" in developer.text


def test_structures_say_what_they_do(base: Any, look: Any, views: Any) -> None:
    (view,) = views("Developer", look(base()))
    assert marks(view, "structure") == [
        ("CyberneticsCore", "no power"),
        ("Gateway", ""),
        ("Gateway", "Train_Stalker 25% then 1 Train_Zealot"),
        ("Nexus", "Train_Probe 40%, 14 of 16 workers, 50 energy"),
        ("Pylon", ""),
        ("Stargate", "35% built"),
        ("WarpGate", ""),
    ]


@pytest.mark.parametrize(("abilities", "ready"), [(None, None), ({}, 0)])
def test_warp_gates_that_are_ready_are_counted(
    abilities: dict[int, frozenset[int]] | None, ready: int | None, base: Any, look: Any, views: Any
) -> None:
    (view,) = views("Developer", look(base(), abilities=abilities))
    assert (view.warp_gates.count, view.warp_gates.ready) == (1, ready)


def test_a_view_says_the_same_on_the_wire(base: Any, look: Any, views: Any) -> None:
    for agent in ("Commander", "Developer", "Builder", "CombatGroup1"):
        (view,) = views(agent, look(base()))
        assert type(view).model_validate_json(view.model_dump_json()) == view
