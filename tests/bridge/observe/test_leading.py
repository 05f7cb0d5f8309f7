"""Texts for those who lead: the map by its places, both armies, what an order cost, and the economy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.catalogue.functions import functions
from khala_bridge.observe import Feedback, Observer
from khala_protocol.messages import ArmyPart, Toll

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from khala_bridge.state import Snapshot
    from khala_protocol.messages import View


@pytest.fixture
def views(base_task: Any) -> Callable[..., list[View]]:
    """Return the views of an agent, snapshot after snapshot."""

    def see(agent: str, *snapshots: Snapshot, feedback: Mapping[int, Feedback] | None = None) -> list[View]:
        observer = Observer(base_task)
        heard = feedback or {}
        found = []
        for number, snapshot in enumerate(snapshots):
            given = {agent: heard[number]} if number in heard else None
            found.append(observer.observe(snapshot, given).agents[agent].view)
        return found

    return see


def moving(one: Any, x: float, y: float) -> Any:
    place = one.orders.add(ability_id=functions()["Move_screen"].ability_id).target_world_space_pos
    place.x, place.y = x, y
    return one


# --- the map --------------------------------------------------------------------------------------------------


def test_a_place_is_held_by_whose_town_hall_stands_there(base: Any, unit: Any, look: Any, views: Any) -> None:
    theirs = unit(0x9, "Hatchery", 11.5, 47.5, alliance="enemy", build_progress=0.5)
    free, held = views("Commander", look(base()), look([*base(), theirs]))
    assert [(place.name, place.holder, place.about) for place in free.places] == [
        ("Base 1", "own", "Nexus"), ("Base 2", "", ""),
    ]  # fmt: skip
    assert held.places[1].but(minimap=(0, 0)).holder == "enemy"
    assert held.places[1].about == "Hatchery, 50% built"


def test_a_side_without_a_town_hall_has_no_map(unit: Any, look: Any, views: Any) -> None:
    (view,) = views("Commander", look([unit(1, "Stalker", 30, 30)]))
    assert view.places == ()


# --- the armies -----------------------------------------------------------------------------------------------


def test_the_army_is_told_by_place_with_what_most_of_it_does(unit: Any, look: Any, views: Any) -> None:
    home = unit(1, "Nexus", 11.5, 17.5)
    guard = [unit(tag, "Zealot", 14, 20) for tag in (2, 3)]
    out = [moving(unit(tag, "Stalker", 40, 40 + tag), 60, 60) for tag in (4, 5)]
    (view,) = views("Commander", look([home, *guard, *out, unit(6, "Probe", 12, 12), unit(7, "Zealot", 50, 8)]))
    assert view.army.parts == (
        ArmyPart(minimap=(40, 19.5), units={"Stalker": 2}, doing="Move to [60, 4]", value=350),
        ArmyPart(place="Base 1", minimap=(14, 44), units={"Zealot": 2}, doing="idle", value=200),
        ArmyPart(minimap=(50, 56), units={"Zealot": 1}, doing="idle", value=100),
    )
    assert view.army.value == 650


def test_a_worker_on_its_way_far_from_home_is_a_scout(unit: Any, look: Any, views: Any) -> None:
    units = [
        unit(1, "Nexus", 11.5, 17.5),
        moving(unit(2, "Probe", 20, 20), 60, 60),
        moving(unit(3, "Probe", 12, 20), 15, 20),
    ]
    (view,) = views("Commander", look(units))
    assert [part.units for part in view.army.scouts] == [{"Probe": 1}]


def test_enemies_are_remembered_where_they_were_seen_for_three_minutes(unit: Any, look: Any, views: Any) -> None:
    home, roach = unit(1, "Nexus", 11.5, 17.5), unit(2, "Roach", 40, 40, alliance="enemy")
    seen, gone, forgotten = views(
        "Commander", look([home, roach], loop=2240), look([home], loop=3360), look([home], loop=6720)
    )
    (part,) = seen.army.enemies
    assert part == ArmyPart(minimap=(40, 24), units={"Roach": 1}, value=100, away=36, in_sight=1)
    assert gone.army.enemies == (part.but(unseen_s=50.0, in_sight=0),)
    assert forgotten.army.enemies == ()


def test_of_enemies_of_whom_only_some_are_in_sight_it_says_how_many(base_task: Any, unit: Any, look: Any) -> None:
    home, near, gone = unit(1, "Nexus", 11.5, 17.5), unit(2, "Roach", 40, 40, alliance="enemy"), (3, "Roach", 41, 40)
    observer = Observer(base_task)
    observer.observe(look([home, near, unit(*gone, alliance="enemy")], loop=2240))
    text = observer.observe(look([home, near], loop=2464)).agents["Commander"].text
    assert "the nearest 36 from your nearest base: 2 Roach, 1 of them in sight\n" in text


def test_what_an_order_cost_is_counted_from_the_last_one(unit: Any, look: Any, views: Any) -> None:
    home, mine, foe = (
        unit(1, "Nexus", 11.5, 17.5),
        unit(2, "Zealot", 30, 30),
        unit(3, "Roach", 31, 30, alliance="enemy"),
    )
    moments = [
        look([home, mine, foe], loop=224),
        look([home, mine, foe], loop=448),
        look([home, foe], loop=672, dead=frozenset({2})),
        look([home], loop=896, dead=frozenset({3})),
    ]
    found = views("Commander", *moments, feedback={1: Feedback(ordered=True)})
    assert [view.toll for view in found] == [
        None,
        None,
        Toll(since_s=10.0, lost={"Zealot": 1}),
        Toll(since_s=20.0, lost={"Zealot": 1}, killed={"Roach": 1}),
    ]


# --- the economy ----------------------------------------------------------------------------------------------


def test_workers_and_supply_to_come_are_counted(base: Any, unit: Any, look: Any, views: Any) -> None:
    growing = unit(0x99, "Pylon", 30, 40, build_progress=0.5)
    gas = unit(0x98, "Assimilator", 8.5, 10.5)
    gas.assigned_harvesters, gas.ideal_harvesters = 2, 3
    (view,) = views("Developer", look([*base(), growing, gas]))
    assert (view.economy.gatherers, view.economy.room) == ((14, 2, 1), (16, 3))
    assert view.economy.supply_coming == 8
    assert view.economy.casters == {"Nexus": (50,), "Sentry": (62,)}


def test_supply_is_full_at_the_pace_of_the_last_minute(base: Any, look: Any, views: Any) -> None:
    def at(loop: int, used: int) -> Any:
        return look(base(), loop=loop, player={"food_used": used, "food_cap": 31})

    *_, view = views("Developer", at(0, 10), at(672, 15), at(1344, 21))
    assert view.economy.full_in_s == round(10 * 60 / 11)


def test_the_page_names_what_beats_the_enemy(pages: Any) -> None:
    assert "        Roach: Stalker" not in pages()["Developer"]  # a Roach beats it
    assert "Energy: Nexus 50; Sentry 62" in pages()["Developer"]
