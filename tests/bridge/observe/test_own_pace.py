"""Agents that look at their own pace: each is told once of everything since its own last observation."""

from __future__ import annotations

import gc
from typing import TYPE_CHECKING, Any

import pytest
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.observe import Observer
from khala_bridge.observe.scene import SideScene
from khala_orchestrator.config import load_task
from khala_protocol.messages import Alert

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.state import Snapshot
    from khala_protocol.messages import View

S, T, ROACH = 0x100210001, 0x100220001, 0x100310001


@pytest.fixture
def paces(base_task: Any) -> Callable[..., list[View]]:
    """Return an agent's views of some snapshots; it is asked at those with these numbers alone."""

    def see(agent: str, asked: set[int], *snapshots: Snapshot) -> list[View]:
        observer, views = Observer(base_task), []
        for number, snapshot in enumerate(snapshots):
            seen = observer.observe(snapshot)
            if number in asked:
                views.append(seen.agents[agent].view)
        return views

    return see


def told(view: View) -> list[tuple[str, str, float | None]]:
    return [(event.what, event.type, event.amount) for event in view.teams[0].events]


def test_a_team_is_told_of_all_that_happened_since_its_own_last_observation(unit: Any, look: Any, paces: Any) -> None:
    def fight(health: float, *others: Any, **fields: Any) -> Snapshot:
        return look([unit(S, "Stalker", 30, 17, health=health, shield=0), *others], **fields)  # type: ignore[no-any-return]

    mate, foe, late = (
        unit(T, "Stalker", 30, 19),
        unit(ROACH, "Roach", 34, 17, alliance="enemy"),
        unit(50, "Stalker", 31, 17),
    )
    moments = [
        fight(80, mate, foe),
        fight(70, mate, foe),
        fight(60, foe, dead=frozenset({T})),
        fight(50, dead=frozenset({ROACH})),
        fight(45, late),
    ]
    first, last = paces("CombatGroup1", {0, 4}, *moments)
    assert told(first) == []
    assert told(last) == [
        ("hurt", "Stalker", 35), ("joined", "Stalker", None), ("died", "Stalker", None), ("died", "Roach", None)
    ]  # fmt: skip
    *_, second, third = paces("CombatGroup1", {0, 3, 4}, *moments)
    assert told(second) == [("hurt", "Stalker", 30), ("died", "Stalker", None), ("died", "Roach", None)]
    assert told(third) == [("hurt", "Stalker", 5), ("joined", "Stalker", None)]


def test_an_agent_of_the_whole_side_is_told_of_each_step_between_once(unit: Any, look: Any, paces: Any) -> None:
    pylon, nuke = unit(3, "Pylon", 20, 20, build_progress=0.5), sc_pb.NuclearLaunchDetected
    hall, foe = unit(1, "Nexus", 10, 10), unit(9, "Roach", 11, 11, alliance="enemy")
    moments = [
        look([hall, pylon]),
        look([hall, unit(3, "Pylon", 20, 20), foe], alerts=(nuke,)),
        look([hall, unit(3, "Pylon", 20, 20), unit(4, "Zealot", 30, 30)], upgrades=(87,)),
        look([hall, unit(3, "Pylon", 20, 20), unit(4, "Zealot", 50, 50)], dead=frozenset({9})),
        look([hall, unit(3, "Pylon", 20, 20)], dead=frozenset({4})),
        look([hall, unit(3, "Pylon", 20, 20)]),
    ]
    _, between, after = paces("Commander", {0, 4, 5}, *moments)
    assert [(event.what, event.type) for event in between.events] == [
        ("finished", "Pylon"), ("appeared", "Roach"), ("finished", "Zealot"), ("researched", "Blink"),
        ("died", "Roach"), ("died", "Zealot"),
    ]  # fmt: skip
    assert between.warnings == ("NuclearLaunchDetected",)
    assert between.alerts == (Alert(minimap=(50, 14), units={"Zealot": 1}, lost=0, died=1),)  # where it was last
    assert (after.events, after.warnings, after.alerts) == ((), (), ())


def test_an_agent_that_looks_late_for_the_first_time_is_told_of_the_episode(unit: Any, look: Any, paces: Any) -> None:
    hall = unit(1, "Nexus", 10, 10)
    (late,) = paces(
        "Commander", {2}, look([hall, unit(4, "Zealot", 30, 30)]), look([hall], dead=frozenset({4})), look([hall])
    )
    assert [(event.what, event.type) for event in late.events] == [("died", "Zealot")]


def test_the_pace_of_one_agent_changes_nothing_for_another(unit: Any, snapshot: Any) -> None:
    observer, alone = Observer(load_task("2s3z_pair")), Observer(load_task("2s3z_pair"))
    amounts = []
    for health in (80, 60, 40, 20):
        moment = snapshot([unit(1, "Stalker", 10, 16, health=health), unit(2, "Zealot", 14, 16)])
        both, one = observer.observe(moment).agents, alone.observe(moment).agents
        if health != 60:
            amounts += [event.amount for event in both["Zealots"].teams[0].view.events]
        assert both["Stalkers"] == one["Stalkers"]
    assert amounts == [40, 20]


def test_a_stage_is_reached_though_nobody_looks(unit: Any, look: Any, paces: Any) -> None:
    away, there = (look([unit(S, "Stalker", *at)]) for at in ((10, 10), (32, 32)))
    assert [view.teams[0].task for view in paces("CombatGroup1", {0, 2}, away, there, away)] == [
        "Go to [32, 32].", "Hold [32, 32]."
    ]  # fmt: skip


def test_nothing_is_made_for_agents_that_do_not_look(unit: Any, snapshot: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    observer = Observer(load_task("2s3z_pair"))
    made: list[int] = []
    monkeypatch.setattr("khala_bridge.observe.observer.SideScene", lambda *_: made.append(1))
    moments = [observer.observe(snapshot([unit(1, "Stalker", 10, 16)], loop=loop)) for loop in range(3)]
    assert made == []
    assert [team.name for team in moments[-1].teams["Stalkers"]] == ["Stalker-1"]


def test_a_moment_that_is_over_is_not_observed_any_more(unit: Any, snapshot: Any) -> None:
    observer = Observer(load_task("2s3z_pair"))
    old = observer.observe(snapshot([unit(1, "Stalker", 10, 16)], loop=8))
    kept = old.agents["Stalkers"]
    observer.observe(snapshot([unit(1, "Stalker", 10, 16)], loop=16))
    assert old.agents["Stalkers"] is kept
    assert kept.game_loop == 8
    with pytest.raises(RuntimeError, match=r"^Zealots was not observed at game loop 8, and that moment is over; "):
        old.agents["Zealots"]


def test_the_side_knows_teams_and_the_dead_without_any_agents_observation(unit: Any, snapshot: Any) -> None:
    observer = Observer(load_task("2s3z_pair"))
    units = [unit(1, "Stalker", 10, 16), unit(2, "Zealot", 14, 16)]
    seen = observer.observe(snapshot(units, loop=8, dead=frozenset({9})))
    later = observer.observe(snapshot(units[:1], loop=16, dead=frozenset({2})))
    assert [seen.team_of(tag) for tag in (1, 2, 3)] == ["Stalker-1", "Zealot-1", None]
    assert (seen.died, later.died) == ({9: 8}, {9: 8, 2: 16})
    assert (later.team_of(2), list(later.configs)) == (None, ["Stalkers", "Zealots"])
    observer.begin()
    assert observer.observe(snapshot(units)).died == {}


def test_no_scene_outlives_its_moment_for_an_agent_that_is_never_asked_again(unit: Any, snapshot: Any) -> None:
    observer = Observer(load_task("2s3z_pair"))
    before = sum(isinstance(thing, SideScene) for thing in gc.get_objects())
    observer.observe(snapshot([unit(1, "Stalker", 10, 16), unit(2, "Zealot", 14, 16)])).agents["Zealots"]
    for loop in range(5):
        observer.observe(snapshot([unit(1, "Stalker", 10, 16)], loop=loop)).agents["Stalkers"]
    gc.collect()
    assert sum(isinstance(thing, SideScene) for thing in gc.get_objects()) - before <= 1
