"""Words → commands: calls that are understood, calls that are refused, and the words of refusals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, get_args

import pytest

from khala_bridge.act import Actor, Command, JointAction
from khala_bridge.frames import WorldPoint
from khala_bridge.observe import Observer
from khala_bridge.task.config import AgentConfig
from khala_protocol.messages import RejectionReason
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Callable

    from s2clientprotocol import raw_pb2
    from s2clientprotocol import sc2api_pb2 as sc_pb

    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import TaskConfig

    Make = Callable[..., raw_pb2.Unit]

S1, S2, Z1, Z2 = 0x100040001, 0x100080001, 0x1000C0001, 0x100100001
FOE, FAR_FOE, DEAD = 0x100180001, 0x1001C0001, 0x100200001
EVERYTHING = (
    "No_Operation",
    "Hold_Position",
    "Stop",
    "Move_Screen",
    "Move_Minimap",
    "Attack_Unit",
    "Select_Unit_Move_Screen",
    "Select_Unit_Move_Minimap",
    "Select_Unit_Attack_Unit",
    "Ability_Blink_Screen",
    "Select_Unit_Blink_Screen",
)
AGENT = AgentConfig.model_validate(
    {
        "name": "A",
        "role": "",
        "teams": [
            {"name": "Stalker-1", "unit_types": ["Stalker"]},
            {"name": "Mixed-1", "unit_types": ["Zealot", "Observer"]},
            {"name": "Zealot-9", "unit_types": ["Adept"]},
        ],
        "actions": {
            "Stalker": EVERYTHING,
            "Zealot": ("Attack_Unit", "Move_Screen", "Select_Unit_Attack_Unit", "Stop"),
            "Observer": ("Attack_Unit", "Move_Screen", "Select_Unit_Attack_Unit"),
            "Adept": ("Stop",),
        },
    }
)


@pytest.fixture
def world(unit: Make, snapshot: Callable[..., Snapshot]) -> Callable[..., Snapshot]:
    def make(**fields: Any) -> Snapshot:
        units = [
            unit(S1, "Stalker", 10, 10),
            unit(S2, "Stalker", 12, 11),
            unit(Z1, "Zealot", 11, 8),
            unit(Z2, "Observer", 11, 9),
            unit(FOE, "Zealot", 15, 10, alliance="enemy"),
            unit(FAR_FOE, "Stalker", 30, 30, alliance="enemy"),
        ]
        return snapshot(units, dead=frozenset({DEAD}), **fields)

    return make


@pytest.fixture
def act(task: Callable[..., TaskConfig], world: Callable[..., Snapshot]) -> Callable[..., JointAction]:
    """Return the joint action of one reply of the agent above."""

    def play(reply: str, *, teams: slice = slice(None), max_actions: int = 9, **fields: Any) -> JointAction:
        agent = AGENT.model_copy(update={"teams": AGENT.teams[teams]})
        config = task("2s3z", agents=(agent,), max_actions=max_actions)
        observation = Observer(config).observe(world(**fields))
        return Actor(config).joint(observation, {"A": parse(reply)})

    return play


def team(*calls: str, name: str = "Stalker-1") -> str:
    return "\n".join(("Actions:", f"Team {name}:", *calls))


def names(joint: JointAction) -> list[str]:
    return [command.said.action.name for command in joint.commands if command.said]


def orders(joint: JointAction) -> list[tuple[str, tuple[int, ...], object, bool]]:
    return [(c.said.action.name, c.units, c.target, c.queued) for c in joint.commands if c.said]


# --- understood ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("call", "name", "units", "target"),
    [
        ("<Attack_Unit(0x100180001)>", "Attack_Unit", (S1, S2), FOE),
        ("<Attack_Unit(100180001)>", "Attack_Unit", (S1, S2), FOE),  # without 0x
        ("<Attack_Unit(4296540161)>", "Attack_Unit", (S1, S2), FOE),  # in decimal
        ("<Attack_Unit(018)>", "Attack_Unit", (S1, S2), FOE),  # its mark in a picture
        ('attack_unit(team="Stalker-1", tag=0x100180001)', "Attack_Unit", (S1, S2), FOE),
        ("<attack_unit(4296540161)>", "Attack_Unit", (S1, S2), FOE),
        ("<Hold_Position()>", "Hold_Position", (S1, S2), None),
        ("<Move_Screen([12, 12])>", "Move_Screen", (S1, S2), WorldPoint(10, 10)),
        ("<Move_Screen([24, 0])>", "Move_Screen", (S1, S2), WorldPoint(22, 22)),
        ("<Move_Minimap([32, 10])>", "Move_Minimap", (S1, S2), WorldPoint(16, 27)),
        ("<Select_Unit_Move_Screen(0x100080001, [14, 9])>", "Select_Unit_Move_Screen", (S2,), WorldPoint(12, 13)),
        ("<Select_Unit_Attack_Unit(0x100080001, 0x100180001)>", "Select_Unit_Attack_Unit", (S2,), FOE),
        ("<Ability_Blink_Screen([13, 12])>", "Ability_Blink_Screen", (S1, S2), WorldPoint(11, 10)),
    ],
)
def test_a_call_becomes_a_command(
    call: str, name: str, units: tuple[int, ...], target: object, act: Callable[..., JointAction]
) -> None:
    joint = act(team(call), upgrades=(87,))
    assert orders(joint) == [(name, units, target, False)]
    assert joint.rejections["A"] == ()


def test_a_call_that_orders_nothing_is_accepted_and_commands_nothing(act: Callable[..., JointAction]) -> None:
    joint = act(team("<No_Operation()>"))
    assert (joint.commands, joint.accepted["A"]) == ((), ("Stalker-1 <No_Operation()>",))


def test_accepted_calls_are_told_in_the_words_of_the_catalogue(act: Callable[..., JointAction]) -> None:
    assert act(team("<move_screen((3.5,4))>")).accepted["A"] == ("Stalker-1 <Move_Screen([3.5, 4])>",)


@pytest.mark.parametrize("heading", ["Team Stalker-1", "team stalker-1", "Team Stalker 1"])
def test_a_team_is_known_in_any_case_and_with_a_blank(heading: str, act: Callable[..., JointAction]) -> None:
    assert len(act(f"Actions:\n{heading}:\n<Stop()>").commands) == 1


def test_the_only_team_needs_no_heading(act: Callable[..., JointAction]) -> None:
    assert orders(act("<Stop()>", teams=slice(0, 1))) == [("Stop", (S1, S2), None, False)]


def test_a_heading_for_all_teams_speaks_for_each(act: Callable[..., JointAction]) -> None:
    joint = act(team("<Move_Screen([12, 12])>", name="All teams"))
    assert [c.units for c in joint.commands] == [(S1, S2), (Z1, Z2)]
    assert len(joint.accepted["A"]) == 2


def test_only_the_units_that_can_do_it_are_told_to(act: Callable[..., JointAction]) -> None:
    joint = act(team("<Attack_Unit(0x100180001)>", "<Stop()>", name="Mixed-1"))
    assert [c.units for c in joint.commands] == [(Z1,), (Z1,)]


# --- the order of commands ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("calls", "commands"),
    [
        (  # the first replaces what the team did, the next ones wait
            ["<Move_Screen([12, 12])>", "<Attack_Unit(0x100180001)>", "<Hold_Position()>"],
            [((S1, S2), False), ((S1, S2), True), ((S1, S2), True)],
        ),
        (["<Move_Screen([12, 12])>", "<Stop()>"], [((S1, S2), False), ((S1, S2), False)]),  # Stop never waits
        (  # an attack does not cancel the blink of the same reply
            ["<Ability_Blink_Screen([12, 12])>", "<Attack_Unit(0x100180001)>"],
            [((S1, S2), False), ((S1, S2), True)],
        ),
        (  # one unit's order does not make the other one wait for what it did before
            ["<Select_Unit_Move_Screen(0x100040001, [12, 12])>", "<Select_Unit_Move_Screen(0x100080001, [12, 12])>"],
            [((S1,), False), ((S2,), False)],
        ),
        (  # a unit with an order of its own is left out of the team's, whichever stands first
            ["<Select_Unit_Move_Screen(0x100040001, [12, 12])>", "<Attack_Unit(0x100180001)>"],
            [((S1,), False), ((S2,), False)],
        ),
        (
            ["<Attack_Unit(0x100180001)>", "<Select_Unit_Move_Screen(0x100040001, [12, 12])>"],
            [((S2,), False), ((S1,), False)],
        ),
        (  # … unless all units have one
            [
                "<Select_Unit_Move_Screen(0x100040001, [12, 12])>",
                "<Select_Unit_Move_Screen(0x100080001, [12, 12])>",
                "<Attack_Unit(0x100180001)>",
            ],
            [((S1,), False), ((S2,), False), ((S1, S2), True)],
        ),
    ],
)
def test_the_first_order_of_a_unit_replaces_and_later_ones_wait(
    calls: list[str], commands: list[tuple[tuple[int, ...], bool]], act: Callable[..., JointAction]
) -> None:
    joint = act(team(*calls), upgrades=(87,))
    assert [(c.units, c.queued) for c in joint.commands] == commands
    assert len(joint.accepted["A"]) == len(calls)


def test_teams_do_not_wait_for_each_other(act: Callable[..., JointAction]) -> None:
    reply = team("<Move_Screen([12, 12])>") + "\n" + team("<Move_Screen([12, 12])>", name="Mixed-1")
    assert [c.queued for c in act(reply).commands] == [False, False]


# --- refused ------------------------------------------------------------------------------------------------------

TEAMS = "your teams are Stalker-1, Mixed-1."
REFUSED = [
    ("<Atack_Unit(0x1)>", "unknown_action", "There is no action Atack_Unit; did you mean <Attack_Unit(tag)>?"),
    (
        "<Build_Nexus()>",
        "unknown_action",
        "There is no action Build_Nexus; you can say <No_Operation()>, <Hold_Position()>, <Stop()> and 8 others.",
    ),
    (
        "<Attack(0x1)>",
        "unknown_action",
        "There is no action Attack; like it are <Attack_Unit(tag)>, <Select_Unit_Attack_Unit(tag, tag)>.",
    ),
    (
        "<Use_Blink([3, 4])>",
        "unknown_action",
        (
            "There is no action Use_Blink; like it are <Select_Unit_Blink_Screen(tag, screen)>, "
            "<Ability_Blink_Screen(screen)>."
        ),
    ),
    ("<Stop(0x1)>", "wrong_arguments", "Stop takes no arguments: write <Stop()>."),
    ("<Attack_Unit()>", "wrong_arguments", "Attack_Unit takes (tag): write it like <Attack_Unit(0x100180001)>."),
    (
        "<Attack_Unit(Zealot)>",
        "wrong_arguments",
        "Attack_Unit takes (tag): write it like <Attack_Unit(0x100180001)>.",
    ),
    ("<Move_Screen(12)>", "wrong_arguments", "Move_Screen takes (screen): write it like <Move_Screen([12, 9.5])>."),
    (
        "<Select_Unit_Move_Screen([3, 4], [5, 6])>",
        "wrong_arguments",
        "Select_Unit_Move_Screen takes (tag, screen): write it like <Select_Unit_Move_Screen(0x100040001, [12, 9.5])>.",
    ),
    (
        "<Move_Minimap(0x100180001)>",
        "wrong_arguments",
        "Move_Minimap takes (minimap): write it like <Move_Minimap([30, 41])>.",
    ),
    (
        "<Attack_Unit(0xabc0001)>",
        "unknown_target",
        "No unit 0xabc0001 is in sight of team Stalker-1; use a tag that stands in its lists.",
    ),
    (
        "<Attack_Unit(0x100200001)>",
        "dead_target",
        "The unit 0x100200001 is dead; choose another target.",
    ),
    (
        "<Attack_Unit(0x1001c0001)>",
        "unknown_target",
        "The enemy Stalker 0x1001c0001 is out of sight of team Stalker-1, at [60, 4] of the minimap; move there first.",
    ),
    (
        "<Attack_Unit(0x100080001)>",
        "friendly_target",
        "0x100080001 is your own Stalker; Attack_Unit needs an enemy unit.",
    ),
    (
        "<Attack_Unit(0x1000c0001)>",
        "friendly_target",
        "0x1000c0001 is your own Zealot; Attack_Unit needs an enemy unit.",
    ),
    (
        "<Select_Unit_Move_Screen(0x1000c0001, [3, 4])>",
        "not_yours",
        (
            "0x1000c0001 is your own Zealot of team Mixed-1 and not one of team Stalker-1; units of team Stalker-1 are "
            "0x100040001, 0x100080001."
        ),
    ),
    (
        "<Move_Screen([50, 4])>",
        "wrong_frame",
        (
            "[50, 4] is outside of the screen, where x and y are from 0 to 24; Move_Screen takes a point of the "
            "screen, for one of the minimap there is Move_Minimap."
        ),
    ),
    ("<Move_Screen([100, 4])>", "out_of_bounds", "[100, 4] is outside of the screen: x and y are from 0 to 24."),
    ("<Move_Screen([-1, 4])>", "out_of_bounds", "[-1, 4] is outside of the screen: x and y are from 0 to 24."),
    (
        "<Move_Screen([1.5, 4])>",
        "out_of_bounds",
        "[1.5, 4] lies beyond the edge of the map; on the minimap it is x 0 to 64, y 0 to 64.",
    ),
    ("<Move_Minimap([65, 4])>", "out_of_bounds", "[65, 4] is outside of the minimap: x and y are from 0 to 64."),
    (
        "<Ability_Blink_Screen([12, 12])>",
        "not_available",
        "Team Stalker-1 cannot do Ability_Blink_Screen now: Blink is not researched.",
    ),
]


@pytest.mark.parametrize(("call", "reason", "message"), REFUSED, ids=[call for call, *_ in REFUSED])
def test_a_call_is_refused_in_words_that_help(
    call: str, reason: str, message: str, act: Callable[..., JointAction]
) -> None:
    reply = team(call)
    joint = act(reply)
    assert joint.commands == ()
    assert joint.accepted["A"] == ()
    (rejection,) = joint.rejections["A"]
    assert (rejection.reason, rejection.message) == (reason, message)
    assert (rejection.team, rejection.start) == ("Stalker-1", reply.index(call))


@pytest.mark.parametrize(
    ("call", "reason", "hint"),
    [
        ("<Move_Minimap([12, 9])>", "wrong_frame", "Move_Minimap takes a point of the minimap, for one of the screen"),
        ("<Move_Minimap([40, 9])>", "out_of_bounds", "on the minimap it is x 0 to 64, y 16 to 64."),
    ],
)
def test_a_point_of_the_screen_on_the_minimap_is_known_where_the_map_ends(
    call: str, reason: str, hint: str, act: Callable[..., JointAction]
) -> None:
    def low(_: sc_pb.ResponseObservation, info: sc_pb.ResponseGameInfo) -> None:
        info.start_raw.playable_area.p1.y = 24

    (rejection,) = act(team(call), change=low).rejections["A"]
    assert rejection.reason == reason
    assert "of the minimap lies beyond the edge of the map" in rejection.message
    assert hint in rejection.message


ELSEWHERE = {  # where the sentences of the other classes are pinned
    "malformed": "tests/protocol/test_speech.py",
    "invalid_target": "tests/bridge/test_validity.py",
    "unknown_team": "below and tests/bridge/test_addressee.py",
    "too_many_actions": "below",
    "unknown_recipient": "tests/orchestrator/test_mailbox.py",
    "too_many_messages": "tests/orchestrator/test_mailbox.py",
    "refused_by_game": "tests/bridge/test_executors.py",
    "too_late": "tests/orchestrator/test_clocks.py",
    "unread": "tests/orchestrator/test_match.py",
}


def test_the_form_of_an_attack_has_no_tag_where_no_enemy_is_in_sight(
    task: Callable[..., TaskConfig], unit: Make, snapshot: Callable[..., Snapshot]
) -> None:
    config = task("2s3z", agents=(AGENT,))
    observation = Observer(config).observe(snapshot([unit(S1, "Stalker", 10, 10), unit(Z1, "Zealot", 11, 8)]))
    (fault,) = Actor(config).joint(observation, {"A": parse(team("<Attack_Unit()>"))}).rejections["A"]
    assert fault.message == "Attack_Unit takes (tag), the tag of an enemy in sight; you see none now."


def test_every_class_of_refusals_is_pinned() -> None:
    assert {reason for _, reason, _ in REFUSED} == set(get_args(RejectionReason)) - set(ELSEWHERE)


@pytest.mark.parametrize(
    ("reply", "reason", "message"),
    [
        (
            team("<Stop()>", name="Stalker-2"),
            "unknown_team",
            f"You have no team Stalker-2; did you mean Stalker-1? Y{TEAMS[1:]}",
        ),
        (team("<Stop()>", name="Sentry"), "unknown_team", f"You have no team Sentry; {TEAMS}"),
        (team("<Stop()>", name="Zealot-9"), "unknown_team", f"Team Zealot-9 has no units left; {TEAMS}"),
        (
            "<Stop()>",
            "unknown_team",
            f'No team is named: write "Team <name>:" above the action; {TEAMS}',
        ),
        (
            team("<Hold_Position()>", name="Mixed-1"),
            "not_available",
            "Team Mixed-1 cannot do Hold_Position now: Zealot has no such action; Observer has no such action.",
        ),
        (
            team("<Select_Unit_Attack_Unit(0x100100001, 0x100180001)>", name="Mixed-1"),
            "not_available",
            "Team Mixed-1 cannot do Select_Unit_Attack_Unit now: Observer has no weapon.",
        ),
        (team("<Stop(0x1"), "malformed", None),
    ],
)
def test_a_call_to_the_wrong_team_is_refused(
    reply: str, reason: str, message: str | None, act: Callable[..., JointAction]
) -> None:
    (rejection,) = act(reply).rejections["A"]
    assert rejection.reason == reason
    assert message is None or rejection.message == message


def test_an_agent_without_units_is_told_so(task: Callable[..., TaskConfig], snapshot: Callable[..., Snapshot]) -> None:
    config = task("2s3z")
    joint = Actor(config).joint(Observer(config).observe(snapshot([])), {"CombatGroupSmac": parse(team("<Stop()>"))})
    assert [r.message for r in joint.rejections["CombatGroupSmac"]] == [
        "There is no action Stop; you can say <Attack_Unit(tag)>, <Move_Screen(screen)>."
    ]
    joint = Actor(config).joint(
        Observer(config).observe(snapshot([])), {"CombatGroupSmac": parse("<Attack_Unit(0x1)>")}
    )
    assert [r.message for r in joint.rejections["CombatGroupSmac"]] == ["You have no units left, so no team can act."]


def test_more_actions_than_a_team_may_have_are_refused_and_wrong_ones_do_not_count(
    act: Callable[..., JointAction],
) -> None:
    calls = ["<Stop()>", "<Attack_Unit(0x1)>", "<Hold_Position()>", "<Stop()>"]
    other = team("<Stop()>", name="Mixed-1")
    joint = act(team(*calls) + "\n" + other, max_actions=2)
    assert names(joint) == ["Stop", "Hold_Position", "Stop"]
    assert [(r.reason, r.message) for r in joint.rejections["A"]] == [
        ("unknown_target", "No unit 0x1 is in sight of team Stalker-1; use a tag that stands in its lists."),
        ("too_many_actions", "Team Stalker-1 had its 2 actions in this reply already."),
    ]


def test_an_agent_may_have_more_actions_than_the_others(
    task: Callable[..., TaskConfig], world: Callable[..., Snapshot]
) -> None:
    agent = AGENT.model_copy(update={"max_actions": 4})
    config = task("2s3z", agents=(agent,), max_actions=2)
    joint = Actor(config).joint(Observer(config).observe(world()), {"A": parse(team(*["<Stop()>"] * 5))})
    assert (len(joint.accepted["A"]), [r.reason for r in joint.rejections["A"]]) == (4, ["too_many_actions"])


def test_one_wrong_call_costs_nothing_but_itself(act: Callable[..., JointAction]) -> None:
    joint = act(team("<Move_Screen([12, 12])>", "<Attack_Unit(0x1, 2)>", "<Hold_Position()>"))
    assert names(joint) == ["Move_Screen", "Hold_Position"]
    assert len(joint.rejections["A"]) == 1


def test_an_agent_without_a_reply_does_nothing(task: Callable[..., TaskConfig], world: Callable[..., Snapshot]) -> None:
    config = task("2s3z")
    assert Actor(config).joint(Observer(config).observe(world()), {}) == JointAction()


def test_commands_come_in_the_order_of_the_agents(
    task: Callable[..., TaskConfig], world: Callable[..., Snapshot]
) -> None:
    config = task("2s3z_pair")
    replies = {
        "Zealots": parse(team("<Hold_Position()>", name="Zealot-1")),
        "Stalkers": parse("<Move_Screen([12, 12])>"),
    }
    joint = Actor(config).joint(Observer(config).observe(world()), replies)
    assert [c.said.team.agent for c in joint.commands if c.said] == ["Stalkers", "Zealots"]
    assert all(isinstance(command, Command) for command in joint.commands)


def test_of_far_too_many_calls_the_rest_is_not_read(act: Callable[..., JointAction]) -> None:
    joint = act(team(*["<Atack_Unitt(0x1)>"] * 400, "<Stop()>"))
    faults = joint.rejections["A"]
    limit = 9 * 2 + 100  # two teams have units
    assert not joint.accepted["A"]
    assert [fault.reason for fault in faults] == ["unknown_action"] * limit + ["too_many_actions"]
    assert faults[-1].message == (
        f"These are too many calls for one reply: this one and all behind it, {401 - limit}, were not read."
    )
