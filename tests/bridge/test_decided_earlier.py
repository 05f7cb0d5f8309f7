"""Decisions on an earlier observation: words mean what the agent saw, and are judged by what is so now."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import pytest

from khala_bridge.act import Actor, JointAction
from khala_bridge.act.actor import fate
from khala_bridge.act.screen_executor import ScreenExecutor
from khala_bridge.act.targets import Targets
from khala_bridge.catalogue.functions import functions
from khala_bridge.frames import WorldPoint
from khala_bridge.observe import Observer
from khala_bridge.task.config import AgentConfig
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import TaskConfig
    from khala_protocol.messages import Fate

    Places: TypeAlias = dict[int, tuple[str, float, float]]

S1, S2, Z1, FOE, NEW = 0x100040001, 0x100080001, 0x1000C0001, 0x100180001, 0x1001C0001
AT: Places = {
    S1: ("Stalker", 40, 40),
    S2: ("Stalker", 42, 41),
    Z1: ("Zealot", 41, 38),
    FOE: ("Zealot", 45, 40),
}
THEN, DIED, NOW = 100, 120, 160
EVERYTHING = ("Stop", "Move_Screen", "Attack_Unit", "Select_Unit_Attack_Unit")


def _agent(name: str, actions: dict[str, tuple[str, ...]]) -> AgentConfig:
    teams = [{"name": f"{type_}-1", "unit_types": [type_]} for type_ in actions]
    return AgentConfig.model_validate({"name": name, "role": "", "teams": teams, "actions": actions})


ARMY = _agent("A", {"Stalker": EVERYTHING, "Zealot": ("Stop",)})


@pytest.fixture
def moments(unit: Any, snapshot: Any) -> Callable[..., list[Snapshot]]:
    """Return three moments: what the agent sees, one in which some die, and the one in which its words take effect."""

    def make(
        *, dead: Iterable[int] = (), gone: Iterable[int] = (), moved: Places | None = None, then: Places | None = None
    ) -> list[Snapshot]:
        def at(places: Places) -> list[Any]:
            return [unit(tag, *place, alliance="enemy" if tag == FOE else "own") for tag, place in places.items()]

        died, away = frozenset(dead), {*dead, *gone}
        before = AT | (then or {})
        later = {tag: place for tag, place in (before | (moved or {})).items() if tag not in away}
        sized: dict[str, Any] = {"size": (96, 96)}
        return [
            snapshot(at(before), loop=THEN, **sized),
            snapshot(at(later), loop=DIED, dead=died, **sized),
            snapshot(at(later), loop=NOW, **sized),
        ]

    return make


@pytest.fixture
def late(task: Callable[..., TaskConfig], moments: Any) -> Callable[..., JointAction]:
    """Return the joint action of a reply to the first of three moments that takes effect in the last one."""

    def play(reply: str, **changes: Any) -> JointAction:
        observer = Observer(config := task("2s3z", agents=(ARMY,), max_actions=9))
        first, between, now = moments(**changes)
        seen = observer.observe(first).agents["A"]
        observer.observe(between)
        return Actor(config).joint(observer.observe(now), {"A": parse(reply)}, {"A": seen})

    return play


def said(*calls: str, team: str = "Stalker-1") -> str:
    return "\n".join(("Actions:", f"Team {team}:", *calls))


ATTACK, MOVE, STOP = f"<Attack_Unit({FOE:#x})>", "<Move_Screen([14, 12])>", "<Stop()>"
BY_ONE = f"<Select_Unit_Attack_Unit({S2:#x}, {FOE:#x})>"
FAR = ("Zealot", 80, 80)


@pytest.mark.parametrize(
    ("call", "changes", "units", "target", "its_fate"),
    [
        (ATTACK, {}, (S1, S2), FOE, "stale"),
        (ATTACK, {"moved": {FOE: FAR}}, (S1, S2), FOE, "stale"),  # wherever it moved, the side sees it
        (ATTACK, {"dead": {S2}}, (S1,), FOE, "adapted"),
        (ATTACK, {"moved": {NEW: ("Stalker", 41, 41)}}, (S1, S2), FOE, "stale"),  # a new one is not ordered
        (ATTACK, {"dead": {Z1}}, (S1, S2), FOE, "stale"),  # of another team
        (BY_ONE, {"dead": {S1}}, (S2,), FOE, "stale"),  # the one that is named is there
        (MOVE, {"moved": {S1: ("Stalker", 60, 60)}}, (S1, S2), WorldPoint(42, 40), "stale"),  # of the old screen
        (MOVE, {"dead": {S1}}, (S2,), WorldPoint(42, 40), "adapted"),  # the head, whom the camera followed
    ],
)  # fmt: skip
def test_what_was_meant_is_carried_out_as_far_as_it_can_be(
    call: str, changes: dict[str, Any], units: tuple[int, ...], target: object, its_fate: Fate, late: Any
) -> None:
    joint = late(said(call), **changes)
    assert [(c.units, c.target) for c in joint.commands] == [(units, target)]
    assert (joint.rejections["A"], joint.fates["A"]) == ((), its_fate)


@pytest.mark.parametrize(
    ("call", "changes", "reason", "message"),
    [
        (ATTACK, {"dead": {FOE}}, "dead_target", "The unit 0x100180001 died 1.8 s ago; choose another target."),
        (
            ATTACK,
            {"gone": {FOE}},
            "unknown_target",
            "The enemy Zealot 0x100180001 is out of sight now; it was at [30, 37] of the minimap when you saw it.",
        ),
        (
            STOP,
            {"dead": {S1, S2}},
            "not_available",
            "Team Stalker-1 cannot do Stop now: its last unit died 1.8 s ago.",
        ),
        (
            STOP,
            {"gone": {S1, S2}},
            "not_available",
            "Team Stalker-1 cannot do Stop now: its units are not on the map.",
        ),
        (BY_ONE, {"dead": {S2}}, "dead_target", "The unit 0x100080001 died 1.8 s ago; it does nothing any more."),
        (
            BY_ONE,
            {"gone": {S2}},
            "not_available",
            "The unit 0x100080001 is not on the map now; it may be inside another one.",
        ),
        (
            f"<Select_Unit_Attack_Unit({S2 + 1:#x}, {FOE:#x})>",
            {"dead": {S2}},
            "unknown_target",
            "There is no unit 0x100080002; did you mean 0x100040001 (Stalker)?",
        ),
    ],
)
def test_what_cannot_be_carried_out_any_more_is_refused_with_the_reason(
    call: str, changes: dict[str, Any], reason: str, message: str, late: Any
) -> None:
    joint = late(said(call), **changes)
    assert [(r.reason, r.message) for r in joint.rejections["A"]] == [(reason, message)]
    assert (joint.commands, joint.fates["A"]) == ((), "refused")


def test_a_part_that_is_refused_makes_a_decision_adapted(late: Any) -> None:
    joint = late(said(STOP) + "\n" + said(STOP, team="Zealot-1"), dead={Z1})
    assert joint.accepted["A"] == ("Stalker-1 <Stop()>",)
    assert joint.fates["A"] == "adapted"


def test_words_that_were_never_right_do_not_make_a_decision_adapted(late: Any) -> None:
    joint = late(said(STOP, "<Dance()>"))
    assert [r.reason for r in joint.rejections["A"]] == ["unknown_action"]
    assert joint.fates["A"] == "stale"


EDGE = {S1: ("Stalker", 90.0, 90.0), S2: ("Stalker", 91.0, 90.0)}


def test_a_refusal_tells_of_the_minimap_since_screens_move_on(late: Any) -> None:
    joint = late(said("<Move_Screen([20, 12])>"), then=EDGE, moved={S1: ("Stalker", 92, 86)})
    (fault,) = joint.rejections["A"]
    inside = "on the minimap it is x 0 to 64, y 0 to 64"
    assert fault.message == f"[20, 12] lies beyond the edge of the map; {inside}."


def test_a_free_place_is_named_on_the_minimap_since_screens_move_on(task: Any, moments: Any) -> None:
    observer = Observer(task("2s3z", agents=(ARMY,)))
    first, _, now = moments(moved={S1: ("Stalker", 50, 50)})
    observer.observe(first)
    seen = observer.observe(now)
    where = ", ".join(f"{round(value, 1):g}" for value in seen.map.minimap(51, 50))
    assert Targets(seen).instead(WorldPoint(51, 50)) == f"; the nearest free place is at [{where}] of the minimap"


def test_the_real_camera_goes_to_the_living_head_of_the_team_that_was_meant(task: Any, moments: Any) -> None:
    observer = Observer(config := task("2s3z", agents=(ARMY,)))
    first, _, now = moments(dead={S1}, moved={S2: ("Stalker", 60, 50)})
    seen = observer.observe(first).agents["A"]
    joint = Actor(config).joint(observer.observe(now), {"A": parse(said(STOP))}, {"A": seen})
    (move,) = next(ScreenExecutor().plan(joint.commands, now, 8)).actions
    place = move.action_raw.camera_move.center_world_space
    assert (place.x, place.y) == (60, 50)


def test_a_present_decision_is_told_of_the_dead_of_the_whole_episode(task: Any, moments: Any) -> None:
    observer = Observer(config := task("2s3z", agents=(ARMY,)))
    *_, now = (observer.observe(moment) for moment in moments(dead={FOE}))
    (fault,) = Actor(config).joint(now, {"A": parse(said(ATTACK))}).rejections["A"]
    assert (fault.reason, fault.message) == (
        "dead_target",
        "The unit 0x100180001 died 1.8 s ago; choose another target.",
    )


# --- two agents of different ages -----------------------------------------------------------------------------------

FIRST, SECOND = 0x100040001, 0x100080001


@pytest.fixture
def base(unit: Any, snapshot: Any) -> Callable[[int, int], Snapshot]:
    """Return a moment with a Gateway and a Nexus, and this many minerals."""

    def make(loop: int, minerals: int) -> Snapshot:
        units = [unit(FIRST, "Gateway", 10, 10, is_powered=True), unit(SECOND, "Nexus", 20, 20)]
        products = {FIRST: "Train_Zealot_quick", SECOND: "Train_Probe_quick"}
        able = {tag: frozenset({functions()[name].ability_id}) for tag, name in products.items()}
        player = {"minerals": minerals, "food_used": 10, "food_cap": 30}
        return snapshot(units, loop=loop, player=player, abilities=able)  # type: ignore[no-any-return]

    return make


@pytest.mark.parametrize(
    ("late_one", "minerals", "paid", "fates"),
    [
        ("First", 110, (FIRST,), {"First": "stale", "Second": "refused"}),
        ("Second", 110, (FIRST,), {"First": "fresh", "Second": "refused"}),
        ("Second", 160, (FIRST, SECOND), {"First": "fresh", "Second": "stale"}),
        ("First", 60, (SECOND,), {"First": "refused", "Second": "fresh"}),  # there were 900 when it decided
    ],
)
def test_agents_are_paid_in_the_order_of_the_task_whichever_decided_earlier(
    late_one: str, minerals: int, paid: tuple[int, ...], fates: dict[str, Fate], task: Any, base: Any
) -> None:
    observer = Observer(config := task("2s3z", agents=(_trainer("First", "Gateway"), _trainer("Second", "Nexus"))))
    seen = {late_one: observer.observe(base(THEN, 900)).agents[late_one]}
    orders = {"Second": f"<Select_Unit_Train_Probe({SECOND:#x})>", "First": f"<Select_Unit_Train_Zealot({FIRST:#x})>"}
    speeches = {name: parse(order) for name, order in orders.items()}
    joint = Actor(config).joint(observer.observe(base(NOW, minerals)), speeches, seen)
    assert tuple(tag for command in joint.commands for tag in command.units) == paid
    assert joint.fates == fates
    assert all("minerals and" in fault.message for faults in joint.rejections.values() for fault in faults)


def _trainer(name: str, structure: str) -> AgentConfig:
    product = {"Gateway": "Zealot", "Nexus": "Probe"}[structure]
    return _agent(name, {structure: (f"Select_Unit_Train_{product}",)})


# --- fates ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("older", "accepted", "rejected", "hindered", "expected"),
    [
        (False, False, False, False, "fresh"),  # no call at all
        (True, False, False, False, "stale"),
        (False, True, True, True, "fresh"),
        (True, True, False, False, "stale"),
        (True, True, True, False, "stale"),
        (True, True, False, True, "adapted"),
        (True, False, True, True, "refused"),
        (False, False, True, False, "refused"),
    ],
)
def test_a_decision_has_one_fate(older: bool, accepted: bool, rejected: bool, hindered: bool, expected: Fate) -> None:
    assert fate(older=older, accepted=accepted, rejected=rejected, hindered=hindered) == expected


def test_a_present_decision_is_fresh_though_it_is_given(task: Any, moments: Any) -> None:
    observer = Observer(config := task("2s3z", agents=(ARMY,)))
    now = observer.observe(moments()[0])
    speeches, seen = {"A": parse(said(STOP))}, {"A": now.agents["A"]}
    assert Actor(config).joint(now, speeches, seen) == Actor(config).joint(now, speeches)
    assert Actor(config).joint(now, speeches, seen).fates == {"A": "fresh"}
