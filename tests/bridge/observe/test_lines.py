"""Single lines of an observation: what they say of a unit, of a count, of a price."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

import pytest
from s2clientprotocol import raw_pb2

from khala_agents.scripted.reading import read
from khala_bridge.catalogue.functions import functions
from khala_bridge.frames import WorldPoint
from khala_bridge.observe import Feedback, Observer
from khala_bridge.observe.text.units import MOST, MOST_PLACES
from khala_bridge.observe.text.words import n, one_line, percent, point, whole
from khala_bridge.state import Alliance, Effect
from khala_protocol.messages import Received

HEAD = "Stalker | tag 0x1 | screen [12, 12] | health 80/80 | shield 80/80"


@pytest.fixture
def stalker_line(unit: Any, snapshot: Any, task: Any) -> Any:
    """Return the line of a Stalker with some fields, in its own team's block."""

    def line(change: Any = None, **fields: Any) -> str:
        made = unit(1, "Stalker", 16, 16, **fields)
        if change is not None:
            change(made)
        text = Observer(task("3s_vs_3z")).observe(snapshot([made])).agents["CombatGroupSmac"].text
        (found,) = (line.strip() for line in text.splitlines() if line.startswith("        Stalker | "))
        return found

    return line


def order(unit: raw_pb2.Unit, function: str, **fields: Any) -> raw_pb2.UnitOrder:
    return unit.orders.add(ability_id=functions()[function].ability_id, **fields)


def ordered_to_a_unit(unit: raw_pb2.Unit) -> None:
    order(unit, "Attack_screen", target_unit_tag=0x1A)


def ordered_to_a_place(unit: raw_pb2.Unit) -> None:
    place = order(unit, "Move_screen").target_world_space_pos
    place.x, place.y = 8, 8


def ordered_twice(unit: raw_pb2.Unit) -> None:
    ordered_to_a_unit(unit)
    ordered_to_a_place(unit)


def training(unit: raw_pb2.Unit) -> None:
    order(unit, "Train_Stalker_quick", progress=0.456)


def training_many(unit: raw_pb2.Unit) -> None:
    training(unit)
    for function in ("Train_Stalker_quick", "Train_Stalker_quick", "Train_Zealot_quick"):
        order(unit, function)


def carrying(unit: raw_pb2.Unit) -> None:
    unit.cargo_space_max = 8
    for name in (73, 74):
        unit.passengers.add(tag=2, unit_type=name)


def empty_hold(unit: raw_pb2.Unit) -> None:
    unit.cargo_space_max = 8


def working(unit: raw_pb2.Unit) -> None:
    unit.assigned_harvesters, unit.ideal_harvesters = 14, 16


@pytest.mark.parametrize(
    ("change", "fields", "more"),
    [
        (None, {}, ""),
        (ordered_to_a_unit, {}, " | order Attack 0x1a"),
        (ordered_to_a_place, {}, " | order Move minimap [16, 48]"),
        (ordered_twice, {}, " | order Attack 0x1a, then Move minimap [16, 48]"),
        (training, {}, " | order Train_Stalker 46%"),
        (training_many, {}, " | order Train_Stalker 46%, then 2 Train_Stalker, then Train_Zealot"),
        (carrying, {}, " | carries Stalker, Zealot, room for 8 in all"),
        (empty_hold, {}, " | carries nobody, room for 8 in all"),
        (working, {}, " | workers 14 of 16"),
        (None, {"is_burrowed": True}, " | burrowed"),
        (None, {"cloak": raw_pb2.CloakedAllied}, " | cloaked"),
        (None, {"is_hallucination": True}, " | hallucination"),
        (None, {"buff_ids": (5, 8)}, " | effects GravitonBeam, GhostCloak"),
    ],
)
def test_a_unit_line_says(change: Any, fields: dict[str, Any], more: str, stalker_line: Any) -> None:
    if more.startswith(" | effects"):
        assert stalker_line(change, **fields).startswith(f"{HEAD} | effects GravitonBeam, ")
    else:
        assert stalker_line(change, **fields) == HEAD + more


@pytest.mark.parametrize(
    ("fields", "part"),
    [
        ({"health": 0.3}, "health 1/80"),
        ({"health": 61.5, "shield": 0}, "health 62/80 | shield 0/80"),
        ({"energy": 50.4, "energy_max": 200}, "energy 50/200"),
        ({"weapon_cooldown": 14.0}, "weapon in 0.62 s"),
    ],
)
def test_a_unit_line_has_its_numbers(fields: dict[str, Any], part: str, stalker_line: Any) -> None:
    assert part in stalker_line(**fields)


@pytest.mark.parametrize(
    ("made", "text"),
    [
        (n(12.0), "12"),
        (n(12.5), "12.5"),
        (n(-0.5), "-0.5"),
        (whole(0.2), "1"),
        (whole(0), "0"),
        (whole(1.6), "2"),
        (percent(0.456), "46%"),
        (point((3.0, 4.5)), "[3, 4.5]"),
        (one_line(" a\n\n b "), "a b"),
    ],
)
def test_small_words(made: str, text: str) -> None:
    assert made == text


def test_what_a_team_passes_of_its_own_side_is_no_event(unit: Any, snapshot: Any, task: Any) -> None:
    observer = Observer(task("3s_vs_3z"))
    standing = [unit(2, "Pylon", 26, 16), unit(3, "Zealot", 26, 17), unit(4, "Probe", 26, 18)]
    moments = (observer.observe(snapshot([unit(1, "Stalker", x, 16), *standing])) for x in (16, 4))
    _, text = (moment.agents["CombatGroupSmac"].text for moment in moments)
    assert "Since the last observation" not in text
    assert not any(name in text for name in ("Pylon", "Zealot", "Probe"))


def test_what_is_being_built_does_not_recover_but_can_be_hit(unit: Any, snapshot: Any, task: Any) -> None:
    observer = Observer(task("3s_vs_3z"))
    head = unit(1, "Stalker", 16, 16)
    texts = []
    for health in (50, 90, 60):
        pylon = unit(2, "Pylon", 18, 16, health=health, build_progress=0.5)
        texts.append(observer.observe(snapshot([head, pylon])).agents["CombatGroupSmac"].text)
    assert "Since the last observation" not in texts[1]
    assert "        ally Pylon was hit: 1, -30 in all\n" in texts[2]


def test_others_of_the_own_side_are_told_by_type_place_and_what_is_left_of_them(
    unit: Any, snapshot: Any, task: Any
) -> None:
    units = [unit(1, "Stalker", 16, 16), unit(2, "Probe", 12, 16), unit(3, "Probe", 13, 18), unit(4, "Zealot", 14, 16)]
    units[-1].shield = 25
    units[-1].buff_ids.append(5)
    units += [unit(10 + place, "Marine", 16 + place, 17) for place in range(MOST_PLACES + 1)]
    text = Observer(task("3s_vs_3z")).observe(snapshot(units)).agents["CombatGroupSmac"].text
    assert (
        "    Allied units by type:\n"
        "        9 Marine around [16, 11]\n"
        "        2 Probe at [8, 12], [9, 10]\n"
        "        1 Zealot at [10, 12] | 83% of health and shield | effects GravitonBeam on 1\n"
    ) in text


def test_of_many_own_units_the_weakest_are_told_one_by_one(unit: Any, snapshot: Any, task: Any) -> None:
    units = [unit(number, "Stalker", 16, 16, health=80 - number) for number in range(1, MOST + 4)]
    text = Observer(task("3s_vs_3z")).observe(snapshot(units)).agents["CombatGroupSmac"].text
    assert [int(tag, 16) for tag in re.findall(r"Stalker \| tag (\w+)", text)] == list(range(4, MOST + 4))
    assert "        3 Stalker at [12, 12], [12, 12], [12, 12] | 99% of health and shield\n" in text


def test_the_nearest_enemies_are_told_one_by_one_and_under_the_next_team_their_places(
    unit: Any, snapshot: Any, task: Any
) -> None:
    own = [unit(1, "Zealot", 16, 16), unit(2, "Stalker", 18, 16)]
    foes = [unit(10 + place, "Zergling", 19 + place / 2, 16, alliance="enemy") for place in range(MOST + 2)]
    text = Observer(task("2s3z")).observe(snapshot([*own, *foes])).agents["CombatGroupSmac"].text
    first, second = text.split("\n\nTeam Stalker-1\n")
    assert len(re.findall(r"Zergling \| tag \w+ \| screen \[.*\] \| distance [\d.]+ \| health 35/35", first)) == MOST
    assert "        2 Zergling at [21, 12], [21.5, 12] | the nearest 9 away" in first
    assert "by place on this screen and distance:\n        Zergling: 0xa [13, 12] 1, 0xb [13.5, 12] 1.5," in second
    assert "health 35/35" not in second.partition("\n\n")[0]


def test_a_team_without_any_unit_leaves_an_agent_with_words_only(base_task: Any, look: Any) -> None:
    text = Observer(base_task).observe(look([])).agents["CombatGroup1"].text
    assert text.endswith(
        "Answer\n    You have no team to order now: write messages to those who have.\n"
        '    Now answer in the parts "Analysis:" and "Communications:".\n'
    )


def test_messages_stand_apart_from_whom_one_can_write_to(pages: Any) -> None:
    told = {"Developer": Feedback(messages=(Received(sender="Commander", recipient="Developer", text="More!"),))}
    text = pages(told)["Developer"]
    assert "\nMessages\n    Message from Commander: '''More!'''\n\nCommunication\n    You can write to: " in text


def test_what_is_only_too_dear_stands_together(base_task: Any, look: Any, unit: Any) -> None:
    gateway = unit(1, "Gateway", 16, 16, is_powered=True)
    nexus = unit(2, "Nexus", 30, 16, is_powered=True)
    poor = {"minerals": 40, "food_used": 10, "food_cap": 30}
    text = Observer(base_task).observe(look([gateway, nexus], abilities={}, player=poor)).agents["Developer"].text
    assert "        minerals missing: Train_Probe 10\n" in text


def test_effects_on_the_ground_are_told_with_their_place_and_size(unit: Any, snapshot: Any, task: Any) -> None:
    seen = snapshot([unit(1, "Stalker", 16, 16)])
    storm = Effect(1, Alliance.ENEMY, 1.5, (WorldPoint(18, 17), WorldPoint(90, 90)))
    bile = Effect(11, Alliance.ENEMY, 0.0, (WorldPoint(16, 18),))
    far = Effect(11, Alliance.ENEMY, 0.5, (WorldPoint(90, 90),))
    seen = dataclasses.replace(seen, effects=(storm, bile, far))
    text = Observer(task("3s_vs_3z")).observe(seen).agents["CombatGroupSmac"].text
    assert "    Effects on the ground:\n        enemy CorrosiveBile at [12, 10] (1.4 s left)\n" in text
    assert "        enemy PsiStorm at [14, 11] (2.9 s left), radius 1.5\n" in text
    assert "[86," not in text
    assert read(text).teams["Stalker-1"].effects == [("CorrosiveBile", (12.0, 10.0)), ("PsiStorm", (14.0, 11.0))]


def test_a_screen_stands_around_the_middle_of_a_team_whatever_one_unit_does(
    unit: Any, snapshot: Any, task: Any
) -> None:
    units = [unit(1, "Stalker", 2, 2), *(unit(tag, "Stalker", 20 + tag, 16) for tag in range(2, 6))]
    text = Observer(task("3s_vs_3z")).observe(snapshot(units)).agents["CombatGroupSmac"].text
    assert "Stalker | tag 0x3 | screen [12, 12]" in text
    assert "Stalker | tag 0x1 | screen [-9, 26] (off screen)" in text


def test_agents_are_told_the_scale_of_the_map_and_its_end_if_they_name_places_of_it(pages: Any) -> None:
    told = pages({})
    for text in told.values():
        assert "as wide as 1 of the screen; distances, ranges and speeds are in cells of the screen\n" in text
    assert "    minimap: the playable map is x" not in told["CombatGroup1"]
