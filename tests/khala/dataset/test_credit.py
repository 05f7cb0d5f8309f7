"""What each agent's turns were worth: shares of the side's values, messages that were acted on, and baselines."""

from __future__ import annotations

from pathlib import Path

import pytest

from khala_protocol.messages import (
    AgentReport,
    Event,
    Observation,
    OrderView,
    Received,
    Report,
    TeamView,
    UnitView,
    View,
)
from khala_protocol.recording import Recording
from khala_sc2.dataset.credit import (
    AgentTurn,
    CreditBook,
    advantages,
    by_agent,
    credit,
    group_mean,
    leave_one_out,
    own_reward,
    rewards_to_go,
    with_weights,
)

GOLDEN = Path(__file__).parents[1] / "golden.mcap"


def unit(tag: str, type_: str, target: str | None = None) -> UnitView:
    orders = (OrderView(name="Attack", target=target),) if target else ()
    return UnitView(
        tag=tag, type=type_, alliance="own", screen=(0, 0), minimap=(0, 0), health=1, health_max=1, orders=orders
    )  # fmt: skip


def seen(
    agent: str, step: int, *units: UnitView, events: tuple[Event, ...] = (), messages: tuple[Received, ...] = ()
) -> Observation:
    view = View(time_s=0, teams=(TeamView(name=agent, units=units, events=events),))
    return Observation(
        run="r", agent=agent, side="blue", episode=0, step=step, game_loop=step, answer_within_s=None, text="",
        view=view, messages=messages,
    )  # fmt: skip


def report(step: int, *agents: AgentReport, **fields: object) -> Report:
    return Report.model_validate(
        {"run": "r", "episode": 0, "step": step, "game_loop": step, "agents": agents, **fields}
    )


def decided(agent: str, *accepted: str) -> AgentReport:
    return AgentReport(agent=agent, side="blue", status="ok", accepted=accepted)


def test_shares_of_all_agents_sum_up_to_the_result_of_the_side() -> None:
    recording = Recording.open(GOLDEN)
    turns = credit(recording)["blue", 0]
    (result,) = recording.results
    assert set(by_agent(turns)) == {"Stalkers", "Zealots"}
    assert sum(turn.killed for turn in turns) == pytest.approx(result.killed.value)
    assert sum(turn.lost for turn in turns) == pytest.approx(result.lost.value)
    assert all(of_one[-1].ending == "win" for of_one in by_agent(turns).values())
    assert all(turn.ending is None for of_one in by_agent(turns).values() for turn in of_one[:-1])


def test_a_kill_is_the_agents_whose_units_aimed_at_the_dead() -> None:
    book = CreditBook()
    book.observe(seen("A", 0, unit("0x1", "Stalker", "0x9"), unit("0x2", "Stalker", "0x9")))
    book.observe(seen("B", 0, unit("0x3", "Zealot"), unit("0x4", "Zealot")))
    book.report(report(0, decided("A"), decided("B"), killed_value=100.0, lost_value=100.0))
    dead = Event(what="died", tag="0x9", type="Zealot", alliance="enemy")
    own = Event(what="died", tag="0x4", type="Zealot", alliance="own")
    book.observe(seen("A", 1, unit("0x1", "Stalker"), unit("0x2", "Stalker"), events=(dead,)))
    book.observe(seen("B", 1, unit("0x3", "Zealot"), events=(dead, own)))
    book.report(report(1, decided("A"), decided("B")))
    assert [(turn.agent, turn.killed, turn.lost) for turn in book.turns[:2]] == [("A", 100, 0), ("B", 0, 100)]


def test_an_agent_that_has_no_units_left_has_lost_all_of_them() -> None:
    book = CreditBook()
    book.observe(seen("A", 0, unit("0x1", "Stalker")))
    book.observe(seen("B", 0, unit("0x3", "Zealot")))
    book.report(report(0, decided("A"), decided("B"), lost_value=100.0))
    book.observe(seen("A", 1, unit("0x1", "Stalker")))
    book.report(report(1, decided("A"), unasked={"B": "no_units"}))
    assert [(turn.agent, turn.lost) for turn in book.turns[:2]] == [("A", 0), ("B", 100)]


@pytest.mark.parametrize(("order", "heeded"), [("<Attack_Unit(0x9)>", 1), ("<Attack_Unit(0x8)>", 0)])
def test_a_message_counts_if_its_reader_does_what_it_names(order: str, heeded: int) -> None:
    book = CreditBook()
    message = Received(sender="A", recipient="B", text="Kill 0x9 first")
    book.observe(seen("A", 0))
    book.report(report(0, decided("A"), messages=(message,)))
    book.observe(seen("B", 1, messages=(message,)))
    book.report(report(1, decided("B", order)))
    assert (book.turns[0].sent, book.turns[0].heeded) == (1, heeded)


def test_a_reward_is_the_weighted_sum_of_its_parts() -> None:
    turn = AgentTurn("A", 3, killed=500, lost=200, accepted=3, refused=1, sent=2, heeded=1, ending="win")
    assert own_reward(turn) == pytest.approx(0.5 - 0.2 + 1 - 0.1 * 0.25 + 0.05 * 0.5)
    assert with_weights(kills=0, losses=2, objective=0, legality=0, messages=0)(turn) == pytest.approx(-0.4)


def test_returns_and_baselines_follow_their_formulas() -> None:
    assert rewards_to_go([1, 2, 4], 0.5) == [3, 4, 4]
    assert group_mean([1, 2, 6]) == [3, 3, 3]
    assert leave_one_out([1, 2, 6]) == [4, 3.5, 1.5]
    assert leave_one_out([5]) == [0]
    assert advantages([1, 3]) == [-1, 1]
    assert advantages([1, 2, 6], leave_one_out) == [-3, -1.5, 4.5]
    assert advantages([0, 4], scaled=True) == [-1, 1]
    assert advantages([1, -1, -1, -1], scaled=True) == pytest.approx([3**0.5, *[-(3**-0.5)] * 3])
    assert advantages([2, 2], scaled=True) == [0, 0]
    assert advantages([0.3, 0.3, 0.3], scaled=True) == [0, 0, 0]
    assert advantages([0.1 + 0.2, 0.3], scaled=True) == [0, 0]  # alike but for rounding
