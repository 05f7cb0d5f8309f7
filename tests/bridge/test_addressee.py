"""The addressee of a call, and the results of actions whose orders a rule of the host finds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.act import Actor, JointAction
from khala_bridge.auto import RULES, NotAvailable, RuleOrder
from khala_bridge.catalogue.catalogue import catalogue
from khala_bridge.catalogue.functions import functions
from khala_bridge.frames import WorldPoint
from khala_bridge.observe import Observer
from khala_bridge.task.config import AgentConfig, AutoConfig
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Callable

    from s2clientprotocol import raw_pb2

    from khala_bridge.auto import RuleRequest
    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import TaskConfig

    Make = Callable[..., raw_pb2.Unit]

S, Z, P, T1, T2, NEXUS = 0x100040001, 0x100080001, 0x1000C0001, 0x100100001, 0x100140001, 0x100180001
AGENT = {
    "name": "Boss",
    "role": "",
    "admits": "any",
    "teams": [
        {"name": "Stalker-1", "unit_types": ["Stalker"]},
        {"name": "Zealot-1", "unit_types": ["Zealot"]},
        {"name": "Templar", "unit_types": ["HighTemplar"]},
        {"name": "Probe-1", "unit_types": ["Probe"]},
        {"name": "Base", "kind": "side", "actions": ["Train_Probe", "No_Operation"]},
    ],
    "actions": {
        "Stalker": ["Stop", "Ability_Blink_Screen", "Select_Unit_Move_Screen"],
        "Zealot": ["Stop", "Select_Unit_Move_Screen"],
        "HighTemplar": ["Stop", "Select_Two_Units_Morph_Archon"],
        "Probe": ["Stop", "Build_Pylon_Screen"],
    },
}


@pytest.fixture
def act(task: Callable[..., TaskConfig], unit: Make, snapshot: Callable[..., Snapshot]) -> Callable[..., JointAction]:
    """Return the joint action of one reply of an agent with four teams of units and one of the side."""

    def play(reply: str, **changed: Any) -> JointAction:
        units = [
            unit(S, "Stalker", 10, 10),
            unit(Z, "Zealot", 11, 10),
            unit(P, "Probe", 12, 10),
            unit(T1, "HighTemplar", 13, 10),
            unit(T2, "HighTemplar", 14, 10),
            unit(NEXUS, "Nexus", 16.5, 16.5),
        ]
        config = task("2s3z", agents=(AgentConfig.model_validate(AGENT),), max_actions=9, **changed)
        seen = snapshot(units, upgrades=(87,), player={"minerals": 500, "food_cap": 100})
        return Actor(config).joint(Observer(config).observe(seen), {"Boss": parse(reply)})

    return play


def said(joint: JointAction) -> tuple[str, ...]:
    return tuple(words.split(" <")[0] for words in joint.accepted["Boss"])


ADDRESSED = [
    ("Actions:\nTeam Stalker-1:\n<Stop()>", ("Stalker-1",)),
    ("Actions:\nTeam stalker_1:\n<Stop()>", ("Stalker-1",)),
    ("Actions:\nStalkers:\n<Stop()>", ("Stalker-1",)),
    ("Actions:\nTeam templar:\n<Stop()>", ("Templar",)),
    ("Actions:\nTeam Stalker-1, Zealot-1:\n<Stop()>", ("Stalker-1", "Zealot-1")),
    ("Actions:\nTeam Stalker-1 and Stalker_1:\n<Stop()>", ("Stalker-1",)),
    ("Actions:\nAll teams:\n<Stop()>", ("Stalker-1", "Zealot-1", "Templar", "Probe-1")),
    ("Actions:\n所有队伍：\n<No_Operation()>", ("Base",)),
    ("<Ability_Blink_Screen([12, 12])>", ("Stalker-1",)),  # the only one that has it
    (f"<Select_Unit_Move_Screen({hex(Z)}, [12, 12])>", ("Zealot-1",)),  # the unit's own
    ("<Train_Probe()>", ("Base",)),
    ("Actions:\nTeam Zealot-1:\n<Train_Probe()>", ("Base",)),  # an order to the side stands where it may
]


@pytest.mark.parametrize(("reply", "teams"), ADDRESSED, ids=[reply for reply, _ in ADDRESSED])
def test_a_call_speaks_to_the_teams_that_are_meant(
    reply: str, teams: tuple[str, ...], act: Callable[..., JointAction]
) -> None:
    joint = act(reply)
    assert joint.rejections["Boss"] == ()
    assert said(joint) == teams


NAMES = "Stalker-1, Zealot-1, Templar, Probe-1, Base."
UNCLEAR = [
    ("<Stop()>", f'No team is named: write "Team <name>:" above the action; your teams are {NAMES}'),
    ("Actions:\nBoth teams:\n<Stop()>", f"You have no team Both teams; your teams are {NAMES}"),
    ("Actions:\nTeam Stalker-1, Sentry-1:\n<Stop()>", f"You have no team Stalker-1, Sentry-1; your teams are {NAMES}"),
    ("Actions:\nTeam Templr:\n<Stop()>", f"You have no team Templr; did you mean Templar? Your teams are {NAMES}"),
]


@pytest.mark.parametrize(("reply", "message"), UNCLEAR, ids=[reply for reply, _ in UNCLEAR])
def test_where_more_than_one_team_may_be_meant_it_is_asked(
    reply: str, message: str, act: Callable[..., JointAction]
) -> None:
    assert [(r.reason, r.message) for r in act(reply).rejections["Boss"]] == [("unknown_team", message)]


def test_two_units_act_together_or_not_at_all(act: Callable[..., JointAction]) -> None:
    reply = "Team Templar:\n<Select_Two_Units_Morph_Archon({}, {})>"
    assert [command.units for command in act(reply.format(hex(T1), hex(T2))).commands] == [(T1, T2)]
    (rejection,) = act(reply.format(hex(T1), hex(S))).rejections["Boss"]
    assert (rejection.reason, rejection.message) == (
        "not_yours",
        (
            f"{hex(S)} is your own Stalker of team Stalker-1 and not one of team Templar; units of team Templar are "
            f"{hex(T1)}, {hex(T2)}."
        ),
    )


def test_one_unit_twice_is_not_two_units(act: Callable[..., JointAction]) -> None:
    (rejection,) = act(f"Team Templar:\n<Select_Two_Units_Morph_Archon({hex(T1)}, {hex(T1)})>").rejections["Boss"]
    assert rejection.reason == "wrong_arguments"
    assert (
        rejection.message == f"Select_Two_Units_Morph_Archon takes two different units, {hex(T1)} stands there twice."
    )


# --- rules -------------------------------------------------------------------------------------------------------


def test_a_rule_is_asked_with_the_units_of_the_team_and_the_point_in_the_world(
    act: Callable[..., JointAction], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[RuleRequest] = []

    def rule(ask: RuleRequest) -> list[RuleOrder]:
        asked.append(ask)
        return [RuleOrder(ask.function, ask.units[:1], ask.point)]

    monkeypatch.setitem(RULES, str(catalogue()["Build_Pylon_Screen"].rule), rule)
    joint = act("Team Probe-1:\n<Build_Pylon_Screen([14, 10])>")
    assert [(ask.units, ask.point, ask.tag) for ask in asked] == [((P,), WorldPoint(14, 12), None)]
    assert [(command.units, command.target) for command in joint.commands] == [((P,), WorldPoint(14, 12))]


@pytest.mark.parametrize(
    ("place", "better"),
    [
        (None, ""),
        (WorldPoint(15.04, 9), "; the nearest free place is at [30.1, 46] of the minimap"),
        (WorldPoint(30, 30), "; the nearest free place is at [60, 4] of the minimap"),
    ],
)
def test_why_a_rule_finds_nothing_is_told_with_the_place_that_would_do(
    place: WorldPoint | None, better: str, act: Callable[..., JointAction], monkeypatch: pytest.MonkeyPatch
) -> None:
    def rule(_: RuleRequest) -> list[RuleOrder]:
        raise NotAvailable("invalid_target", "There is no room.", place)

    monkeypatch.setitem(RULES, str(catalogue()["Build_Pylon_Screen"].rule), rule)
    (rejection,) = act("Team Probe-1:\n<Build_Pylon_Screen([14, 10])>").rejections["Boss"]
    assert (rejection.reason, rejection.message) == ("invalid_target", f"There is no room{better}.")


def test_what_the_host_does_by_itself_comes_last_and_is_nobodys_word(
    act: Callable[..., JointAction], monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[frozenset[int]] = []

    def automatic(auto: AutoConfig, *_: object) -> list[RuleOrder]:
        told.append(_[-1])  # type: ignore[arg-type]  # the tags that agents ordered
        return [RuleOrder(functions()["Train_Probe_quick"], (NEXUS,))] if auto.train_workers else []

    monkeypatch.setattr("khala_bridge.act.actor.automatic", automatic)
    joint = act("Team Stalker-1:\n<Stop()>", auto=AutoConfig(train_workers=True))
    assert [(command.said is None, command.units) for command in joint.commands] == [(False, (S,)), (True, (NEXUS,))]
    assert told == [frozenset({S})]


def test_a_side_team_has_no_screen_to_point_at(act: Callable[..., JointAction]) -> None:
    reply = "Team Base:\n<Train_Probe()>\n<Ability_Blink_Screen([12, 12])>"
    (rejection,) = act(reply).rejections["Boss"]
    assert (rejection.reason, rejection.message) == (
        "not_available",
        "Team Base cannot do Ability_Blink_Screen now: it has no units.",
    )
