"""What a team sees: positions, the units on its screen, its possible actions, events."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from s2clientprotocol import raw_pb2

from khala_bridge.observe import Observer, TeamObservation
from khala_protocol.messages import Frames, Resources

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import TaskConfig
    from khala_protocol.messages import UnitView

    Make = Callable[..., raw_pb2.Unit]
    Snap = Callable[..., Snapshot]
    Task = Callable[..., TaskConfig]

AGENT = "CombatGroupSmac"
STALKER, FOE = 0x100040001, 0x100180001


@pytest.fixture
def first_team(task: Task) -> Callable[..., TeamObservation]:
    """Return the first team of the shipped task 3s_vs_3z, after one or more snapshots."""

    def see(*snapshots: Snapshot, **changed: Any) -> TeamObservation:
        observer = Observer(task("3s_vs_3z", **changed))
        return [observer.observe(snapshot).agents[AGENT].teams[0] for snapshot in snapshots][-1]

    return see


def seen(unit: UnitView) -> tuple[str, tuple[float, float]]:
    return unit.type, unit.screen


def test_the_camera_is_on_the_head_and_y_grows_downwards(unit: Make, snapshot: Snap, first_team: Any) -> None:
    team = first_team(snapshot([unit(1, "Stalker", 10, 20), unit(2, "Stalker", 12, 23)]))
    assert [seen(u) for u in team.view.units] == [("Stalker", (12, 12)), ("Stalker", (14, 9))]
    assert team.view.minimap == (20, 24)
    assert [u.minimap for u in team.view.units] == [(20, 24), (24, 18)]


def test_only_what_is_within_the_frame_is_seen_except_the_teams_own_units(
    unit: Make, snapshot: Snap, first_team: Any
) -> None:
    inside = [unit(5, "Zealot", 21.9, 10, alliance="enemy"), unit(6, "Zealot", -1.9, 21.9, alliance="enemy")]
    outside = [unit(7, "Zealot", 22.1, 10, alliance="enemy"), unit(8, "Probe", 10, 22.1, alliance="ally")]
    own = [unit(1, "Stalker", 10, 10), unit(2, "Stalker", 31, 10)]
    view = first_team(snapshot([*own, *inside, *outside])).view
    assert [u.tag for u in view.enemies] == ["0x5", "0x6"]
    assert view.allies == ()
    assert [u.screen for u in view.units] == [(12, 12), (33, 12)]


def test_a_position_is_rounded_within_its_frame(unit: Make, snapshot: Snap, first_team: Any) -> None:
    near = unit(5, "Zealot", 21.99, 10, alliance="enemy")
    view = first_team(snapshot([unit(1, "Stalker", 10, 10), near])).view
    assert view.enemies[0].screen == (23.9, 12)


def test_units_of_other_teams_are_allies_and_neutral_ones_are_left_out(
    unit: Make, snapshot: Snap, first_team: Any
) -> None:
    units = [
        unit(1, "Stalker", 10, 10),
        unit(2, "Zealot", 11, 10),
        unit(3, "Marine", 12, 10, alliance="ally"),
        unit(4, "MineralField", 10, 12, alliance="neutral", unit_type=341),
        unit(5, "Larva", 10, 12, alliance="enemy"),
        unit(6, "Zealot", 10, 13, alliance="enemy", display_type=raw_pb2.Snapshot),
    ]
    view = first_team(snapshot(units)).view
    assert [(u.type, u.alliance) for u in view.allies] == [("Marine", "ally"), ("Zealot", "ally")]
    assert view.enemies == ()


def test_enemies_are_listed_by_type_and_distance_from_the_middle_of_the_team(
    unit: Make, snapshot: Snap, first_team: Any
) -> None:
    own = [unit(1, "Stalker", 10, 10), unit(2, "Stalker", 10, 14)]
    foes = [unit(t, n, x, 12, alliance="enemy") for t, n, x in ((5, "Zealot", 15), (6, "Zealot", 13), (7, "Adept", 18))]
    view = first_team(snapshot([*own, *foes])).view
    assert [(u.type, u.tag, u.distance) for u in view.enemies] == [
        ("Adept", "0x7", 8),
        ("Zealot", "0x6", 3),
        ("Zealot", "0x5", 5),
    ]


def test_only_ones_own_armed_units_have_a_weapon_and_an_order(unit: Make, snapshot: Snap, first_team: Any) -> None:
    fields: dict[str, Any] = {"weapon_cooldown": 11.2, "orders": (3674,)}
    units = [
        unit(1, "Stalker", 10, 10, **fields),
        unit(2, "Observer", 10, 11),
        unit(5, "Zealot", 10, 12, alliance="enemy", **fields),
    ]
    view = first_team(snapshot(units)).view
    told = {u.type: (u.weapon_cooldown_s, u.order) for u in (*view.units, *view.allies, *view.enemies)}
    assert told == {"Stalker": (0.5, "Attack"), "Observer": (None, None), "Zealot": (None, None)}


def test_states_of_a_unit_are_told(unit: Make, snapshot: Snap, first_team: Any) -> None:
    foe = unit(5, "Zealot", 10, 12, alliance="enemy", cloak=raw_pb2.Cloaked, is_hallucination=True, buff_ids=(5,))
    view = first_team(snapshot([unit(1, "Stalker", 10, 10, energy=20.26, energy_max=50), foe])).view
    (enemy,) = view.enemies
    assert (enemy.cloaked, enemy.hallucination, enemy.buffs) == (True, True, ("GravitonBeam",))
    assert (view.units[0].energy, view.units[0].energy_max) == (20.3, 50)


@pytest.mark.parametrize(("upgrades", "blinks"), [((), False), ((87,), True)])
def test_an_action_is_valid_when_its_upgrade_is_researched(
    upgrades: tuple[int, ...], blinks: bool, unit: Make, snapshot: Snap, task: Task
) -> None:
    config = task("3s_vs_3z")
    agent = config.agents[0].model_copy(update={"actions": {"Stalker": ("Ability_Blink_Screen", "Stop")}})
    observer = Observer(config.model_copy(update={"agents": (agent,)}))
    observation = observer.observe(snapshot([unit(1, "Stalker", 10, 10)], upgrades=upgrades)).agents[AGENT]
    names = [action.name for action in observation.teams[0].view.actions]
    assert names == (["Ability_Blink_Screen", "Stop"] if blinks else ["Stop"])
    assert observation.view.upgrades == (("Blink",) if blinks else ())


def test_the_part_of_the_screen_on_the_map_is_told(unit: Make, snapshot: Snap, first_team: Any) -> None:
    assert first_team(snapshot([unit(1, "Stalker", 3, 30)])).view.bounds == (9, 10, 24, 24)


def test_a_task_may_count_the_screen_in_pixels(unit: Make, snapshot: Snap, first_team: Any) -> None:
    units = [unit(1, "Stalker", 10, 10), unit(2, "Stalker", 13, 10)]
    view = first_team(snapshot(units), frames=Frames(screen=128)).view
    assert [u.screen for u in view.units] == [(64, 64), (80, 64)]


def test_time_and_resources_are_told(unit: Make, snapshot: Snap, task: Task) -> None:
    player = {"minerals": 50, "vespene": 25, "food_used": 10, "food_cap": 15}
    observation = Observer(task("2s3z")).observe(snapshot([unit(1, "Stalker", 10, 10)], loop=1344, player=player))
    view = observation.agents[AGENT].view
    assert view.time_s == 60
    assert view.resources == Resources(minerals=50, vespene=25, supply_used=10, supply_cap=15)


def test_an_agent_without_units_sees_nothing(snapshot: Snap, task: Task) -> None:
    observation = Observer(task("2s3z")).observe(snapshot([])).agents[AGENT]
    assert observation.teams == ()
    assert observation.idle_teams == ("Zealot-1", "Zealot-2", "Stalker-1")
    assert "Teams without units: Zealot-1, Zealot-2, Stalker-1" in observation.text


# --- events -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("before", "now", "events"),
    [
        ({}, {"health": 60}, [("hurt", "own", 20)]),
        ({"shield": 10}, {"shield": 13.5}, [("healed", "own", 3.5)]),
        ({"shield": 10}, {"shield": 10.9}, []),  # a change of less than one point makes no event
        ({}, {}, []),
    ],
)
def test_changes_of_health_and_shield_are_events(
    before: dict[str, float],
    now: dict[str, float],
    events: list[tuple[str, str, float]],
    unit: Make,
    snapshot: Snap,
    first_team: Any,
) -> None:
    team = first_team(*(snapshot([unit(1, "Stalker", 10, 10, **fields)]) for fields in (before, now)))
    assert [(e.what, e.alliance, e.amount) for e in team.view.events] == events


def test_nothing_has_happened_at_the_first_sight_of_a_team(unit: Make, snapshot: Snap, first_team: Any) -> None:
    assert first_team(snapshot([unit(1, "Stalker", 10, 10)])).view.events == ()


def test_who_comes_goes_and_dies_is_told(unit: Make, snapshot: Snap, first_team: Any) -> None:
    head = unit(1, "Stalker", 10, 10)
    foes = {tag: unit(tag, "Zealot", 12, tag, alliance="enemy") for tag in (5, 6, 7)}
    before = snapshot([head, unit(2, "Stalker", 11, 10), foes[5], foes[6]])
    now = snapshot([head, unit(3, "Stalker", 11, 9), foes[7]], dead=frozenset({2, 5}))
    team = first_team(before, now)
    assert [(e.what, e.alliance, e.tag) for e in team.view.events] == [
        ("joined", "own", "0x3"),
        ("appeared", "enemy", "0x7"),
        ("died", "own", "0x2"),
        ("disappeared", "enemy", "0x6"),
        ("died", "enemy", "0x5"),
    ]


def test_a_new_episode_knows_nothing_of_the_one_before(unit: Make, snapshot: Snap, task: Task) -> None:
    observer = Observer(task("3s_vs_3z"))
    first = observer.observe(snapshot([unit(1, "Stalker", 10, 10)])).agents[AGENT]
    observer.observe(snapshot([unit(1, "Stalker", 10, 10, health=5)]))
    observer.begin()
    assert observer.observe(snapshot([unit(1, "Stalker", 10, 10)])).agents[AGENT].view == first.view
