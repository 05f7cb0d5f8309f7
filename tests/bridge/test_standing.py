"""Standing orders: when they are carried out, what they wait for, when they end, and what cannot stand."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.act import Actor
from khala_bridge.act.rejected import CallRejected
from khala_bridge.act.until import read_until
from khala_bridge.knowledge import facts_of
from khala_bridge.observe import Observer
from khala_bridge.task.config import AgentConfig
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Callable

    from s2clientprotocol import raw_pb2

    from khala_bridge.act import JointAction
    from khala_bridge.observe import AgentObservation
    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import TaskConfig
    from khala_protocol.messages import StandingView

    Make = Callable[..., raw_pb2.Unit]

S1, S2, NEXUS, FOE = 0x100040001, 0x100080001, 0x1000C0001, 0x100180001
TRAIN_PROBE, MOVE, BUILD_PYLON = 1006, 16, 881
AGENT = AgentConfig.model_validate(
    {
        "name": "A",
        "role": "",
        "teams": [
            {"name": "Stalker-1", "unit_types": ["Stalker"]},
            {"name": "Base", "kind": "side", "actions": ["Train_Probe", "ChronoBoost_Economy"]},
        ],
        "actions": {"Stalker": ("Hold_Position", "Attack_Minimap", "Attack_Unit", "Select_Unit_Move_Screen")},
    }
)


class Table:
    """A side that plays turn by turn."""

    def __init__(self, task: TaskConfig, unit: Make, snapshot: Callable[..., Snapshot]) -> None:
        self._observer, self._actor, self._unit, self._snapshot = Observer(task), Actor(task), unit, snapshot
        self._loop = 0

    def turn(self, reply: str = "", *, minerals: int = 400, **units: dict[str, Any] | None) -> JointAction:
        """Play a turn; `s1`, `s2`, `nexus` and `foe` are changes of these units, or None for one that is gone."""
        self.look(minerals=minerals, **units)
        return self._actor.joint(self._seen, {"A": parse(reply)} if reply else {})

    def look(self, *, minerals: int = 400, **units: dict[str, Any] | None) -> AgentObservation:
        """Observe the next moment; return what the agent sees of it."""
        self._loop += 112
        places = {
            "s1": (S1, "Stalker", 10, 10),
            "s2": (S2, "Stalker", 12, 10),
            "nexus": (NEXUS, "Nexus", 20, 20),
            "foe": (FOE, "Zealot", 14, 10),
        }
        there = []
        for name, place in places.items():
            if (changes := units.get(name, {})) is not None:
                there.append(self._unit(*place, alliance="enemy" if name == "foe" else "own", **changes))
        dead = frozenset(places[name][0] for name, changed in units.items() if changed is None)
        player = {"minerals": minerals, "food_cap": 15, "food_used": 4}
        now = self._snapshot(there, loop=self._loop, player=player, dead=dead)
        self._seen = self._observer.observe(now, standing=lambda name: self._actor.standing_views(name, self._seen))
        return self._seen.agents["A"]

    def shown(self) -> list[str]:
        """Return what the agent is shown of its orders, when it is asked."""
        views = self._actor.standing_views("A", self._seen)
        self._actor.standing.forget_ended("A")
        return [_words(view) for view in views]


def _words(view: StandingView) -> str:
    return f"{view.number} {view.times} {view.ended or view.waits_for}".rstrip()


@pytest.fixture
def table(task: Callable[..., TaskConfig], unit: Make, snapshot: Callable[..., Snapshot]) -> Table:
    return Table(task("2s3z", agents=(AGENT,), max_actions=1, standing_orders=2), unit, snapshot)


def orders(joint: JointAction) -> list[tuple[str, tuple[int, ...]]]:
    return [(command.function.stem, command.units) for command in joint.commands]


def test_an_order_to_the_side_waits_for_minerals_and_for_a_free_producer_and_ends_with_the_number(table: Table) -> None:
    said = "Team Base:\n<Standing(Train_Probe(), until 2 Probes)>"
    assert orders(table.turn(said, minerals=40)) == []
    assert table.shown() == ["1 0 it costs 50 minerals and 40 are left"]
    assert orders(table.turn()) == [("Train_Probe", (NEXUS,))]
    assert table.shown() == ["1 1"]
    assert orders(table.turn(nexus={"orders": (TRAIN_PROBE,)})) == []
    assert table.shown() == ["1 1 all that could do it are busy"]
    assert orders(table.turn(nexus={"orders": (TRAIN_PROBE, TRAIN_PROBE)})) == []
    assert table.shown() == ["1 1 its end is reached"]
    assert table.shown() == []


def test_what_an_order_waits_for_is_judged_at_the_moment_that_its_agent_sees(table: Table) -> None:
    table.turn("Team Base:\n<Standing(Train_Probe())>\n<Standing(ChronoBoost_Economy())>", minerals=40)
    poor = table.look(minerals=30)
    assert (
        "    1: Base <Train_Probe()>: carried out 0 times; waits: it costs 50 minerals and 30 are left\n" in poor.text
    )
    rich = table.look()
    assert "    1: Base <Train_Probe()>: carried out 0 times\n" in rich.text
    assert _words(rich.view.standing[1]) == "2 0 no Nexus trains Probes that is not boosted yet; train Probes first"


def test_a_nexus_that_trains_boosts_itself(table: Table) -> None:
    training = {"orders": (TRAIN_PROBE,), "energy": 60}
    said = "Team Base:\n<Standing(ChronoBoost_Economy())>"
    assert orders(table.turn(said, nexus=training)) == [("Effect_ChronoBoostEnergyCost", (NEXUS,))]
    assert orders(table.turn(nexus={**training, "energy": 20})) == []
    assert table.shown() == [f"1 1 it needs 50 energy, and your Nexus {NEXUS:#x} has 20"]


def test_an_order_to_units_is_for_the_idle_ones_and_ends_when_they_are_attacked(table: Table) -> None:
    said = "Team Stalker-1:\n<Standing(<Hold_Position()>, until attacked)>"
    assert orders(table.turn(said)) == [("HoldPosition", (S1, S2))]
    assert orders(table.turn(s1={"orders": (MOVE,)})) == [("HoldPosition", (S2,))]
    assert orders(table.turn(s1={"orders": (MOVE,)}, s2={"orders": (MOVE,)})) == []
    assert table.shown() == ["1 2 no unit of the team is idle"]
    assert orders(table.turn(s1={"health": 40})) == []
    assert table.shown() == ["1 2 its end is reached"]


def test_a_call_of_the_same_turn_comes_first_and_the_standing_order_is_no_action_of_its_team(table: Table) -> None:
    said = "Team Stalker-1:\n<Attack_Unit(0x100180001)>\n<Standing(Hold_Position())>"
    assert orders(table.turn(said)) == [("Attack", (S1, S2))]
    assert orders(table.turn()) == [("HoldPosition", (S1, S2))]


def test_an_order_whose_target_is_gone_ends(table: Table) -> None:
    table.turn("Team Stalker-1:\n<Standing(Attack_Unit(0x100180001))>")
    table.turn(foe=None)
    (ended,) = table.shown()
    assert "0x100180001" in ended
    assert table.shown() == []


@pytest.mark.parametrize(
    ("said", "why"),
    [
        ("<Standing(Train_Probes_Now())>", "There is no action Train_Probes_Now"),
        ("Team Stalker-1:\n<Standing(Attack_Minimap([99, 99]))>", "outside"),
        ("Team Stalker-1:\n<Standing(Select_Unit_Move_Screen(0x100040001, [3, 3]))>", "for a team"),
        ("Team Base:\n<Standing(Train_Probe(), until dawn)>", "write until 22 and a type of units"),
        ("Team Base:\n<Standing(Train_Probe(), until minerals 100)>", "is reached already: minerals 100"),
        ("<Revoke(3)>", "You have no standing order 3; you have none."),
    ],
)
def test_what_cannot_stand_is_refused(table: Table, said: str, why: str) -> None:
    (fault,) = table.turn(said).rejections["A"]
    assert why in fault.message
    assert table.shown() == []


def test_a_team_has_only_so_many_and_the_same_order_again_changes_its_end(table: Table) -> None:
    table.turn("Team Stalker-1:\n<Standing(Hold_Position())>\n<Standing(Attack_Minimap([30, 30]))>")
    joint = table.turn("Team Stalker-1:\n<Standing(Hold_Position(), until 9:00)>\n<Standing(Attack_Minimap([9, 9]))>")
    assert joint.accepted["A"] == ("Stalker-1 <Standing(Hold_Position(), until 9:00)>",)
    (fault,) = joint.rejections["A"]
    assert fault.message == (
        "Team Stalker-1 has its 2 standing orders already: revoke one of 1, 2 with <Revoke(number)>."
    )


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("", ""),
        ("22 probes", "22 Probe"),
        ("Probe: 22", "22 Probe"),
        ("warp gate research", "WarpGateResearch"),
        ("04:30", "4:30"),
        ("under attack", "attacked"),
        ("400 minerals", "minerals 400"),
        ("gas 100", "vespene 100"),
    ],
)
def test_an_end_is_understood_in_many_forms(words: str, text: str) -> None:
    assert read_until(words, facts_of("multi")).text == text


def test_an_end_that_is_none_names_the_forms() -> None:
    with pytest.raises(CallRejected, match="until attacked or until minerals 400"):
        read_until("the cows come home", facts_of("multi"))


@pytest.mark.parametrize(("pylons", "orders", "reached"), [(1, 0, False), (2, 0, True), (1, 1, True)])
def test_a_structure_counts_from_when_a_worker_goes_to_build_it(
    unit: Make, snapshot: Callable[..., Snapshot], pylons: int, orders: int, reached: bool
) -> None:
    probe = unit(0x1, "Probe", 5, 5)
    for _ in range(orders):
        order = probe.orders.add(ability_id=BUILD_PYLON)
        order.target_world_space_pos.x, order.target_world_space_pos.y = 20, 20
    own = [unit(0x100 + place, "Pylon", 10 + 3 * place, 10) for place in range(pylons)]
    assert read_until("2 Pylons", facts_of("multi")).is_reached(snapshot([probe, *own]), attacked=False) is reached
