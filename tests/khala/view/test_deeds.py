"""Calls of a reply, each with what became of it and where it is on the map."""

from __future__ import annotations

import pytest

from khala_protocol.messages import AgentReport, Rejection
from khala_sc2.view.deeds import Screen, deeds

SCREENS = {"Stalker-1": Screen((32.0, 20.0), 12.0, 24.0)}
FRAMES = {"move_screen": ("screen",), "move_minimap": ("minimap",), "attack_unit": ("tag",), "stop": ()}
REPLY = """Actions:
    Team Stalker-1:
        <Attack_Unit(0x1a)>
        <Move_Screen([18, 12])>
        <Move_Minimap([40, 8])>
        <Stop(1)>
        <Standing(Train_Probe(), until 22 Probe)>
"""


def report(*accepted: str, refused: tuple[Rejection, ...] = ()) -> AgentReport:
    return AgentReport(agent="A", side="blue", status="ok", accepted=accepted, rejections=refused)


def of(reply: str, made: AgentReport | None) -> dict[str, tuple[bool | None, str]]:
    found = deeds(reply, made, frames=FRAMES, screens=SCREENS)
    return {deed.text: (deed.accepted, deed.reason or "") for deed in found}


def test_each_call_has_its_fate() -> None:
    stop = REPLY.index("<Stop")
    refused = Rejection(reason="wrong_arguments", message="Stop takes no arguments.", text="<Stop(1)>", start=stop)
    accepted = (
        "Stalker-1 <Attack_Unit(0x1a)>", "Stalker-1 <Move_Screen([18, 12])>",
        "Stalker-1 <Standing(Train_Probe(), until 22 Probe)>",
    )  # fmt: skip
    assert of(REPLY, report(*accepted, refused=(refused,))) == {
        "<Attack_Unit(0x1a)>": (True, ""),
        "<Move_Screen([18, 12])>": (True, ""),
        "<Move_Minimap([40, 8])>": (None, ""),  # the host said nothing of it
        "<Stop(1)>": (False, "wrong_arguments"),
        "<Standing(Train_Probe(), until 22 Probe)>": (True, ""),
    }


def test_before_its_report_a_call_has_no_fate() -> None:
    assert {fate for fate, _ in of(REPLY, None).values()} == {None}


def test_places_are_on_the_minimap_in_whatever_frame_they_were_written() -> None:
    places = {deed.text: deed.at for deed in deeds(REPLY, None, frames=FRAMES, screens=SCREENS)}
    assert places["<Move_Screen([18, 12])>"] == (35.0, 20.0)  # 6 of 24 cells right of the middle: 3 of 12
    assert places["<Move_Minimap([40, 8])>"] == (40.0, 8.0)
    assert places["<Attack_Unit(0x1a)>"] is None


def test_tags_are_numbers() -> None:
    assert deeds(REPLY, None, frames=FRAMES, screens=SCREENS)[0].tags == (0x1A,)


def test_what_only_looks_like_a_call_is_a_deed_that_was_refused() -> None:
    reply = "Actions:\n<Attack_Unit(0x1a"
    (fault,) = (Rejection(reason="malformed", message="It is cut off.", text="<Attack_Unit(0x1a", start=9),)
    assert of(reply, report(refused=(fault,))) == {"<Attack_Unit(0x1a": (False, "malformed")}


def test_all_calls_behind_the_last_one_that_is_read_are_refused() -> None:
    reply = "Actions:\n<Stop()>\n<Stop()>\n<Hold_Position()>"
    text = "These are too many calls for one reply: this one and all behind it, 2, were not read."
    many = Rejection(reason="too_many_actions", message=text, text="<Stop()>", start=reply.rindex("<Stop"))
    found = deeds(reply, report("T <Stop()>", refused=(many,)), frames={}, screens={})
    assert [deed.accepted for deed in found] == [True, False, False]


@pytest.mark.parametrize("call", ["Attack_Unit", "attack_unit", "AttackUnit", "Attack Unit"])
def test_names_are_as_models_write_them(call: str) -> None:
    assert set(of(f"Actions:\n<{call}(0x1a)>", report("T <Attack_Unit(0x1a)>")).values()) == {(True, "")}
