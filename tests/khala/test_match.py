"""Whole matches on the simulator with agents on a bus in memory: one agent's fault and its effects on the others."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest
import pytest_asyncio

from khala_agents.policy import FunctionPolicy
from khala_agents.worker import run_worker
from khala_bridge.act.raw_executor import RawExecutor
from khala_bridge.game.game import GameConfig, GameThread, Sides
from khala_bridge.game.pysc2_game import PySC2Game
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_orchestrator.host import host
from khala_protocol.bus import Delivery
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.codec import encode
from khala_protocol.keys import Topic, agent_key
from khala_protocol.messages import Message, Reply, Report, Result
from khala_protocol.recording import Recording
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable
    from pathlib import Path

    from khala_protocol.messages import Briefing, Observation, Wire

    Decide = Callable[[Briefing, Observation], str | Awaitable[str]]

pytestmark = [pytest.mark.game, pytest.mark.asyncio(loop_scope="module")]

RUN = "faults"
WAIT_S = 0.4


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def game(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Sides]:
    sc2path = install(tmp_path_factory.mktemp("sc2"))
    config = GameConfig(sc2path=sc2path, map=load_task("2s3z_pair").map_spec, seed=1)
    async with Sides(GameThread(lambda: PySC2Game(config)), [RawExecutor()]) as side:
        yield side


class Table:
    """A match of two agents, the Zealots well-behaved."""

    def __init__(self, game: Sides, steps: int, record: Path | None = None, **changes: Any) -> None:
        task = change(load_task("2s3z_pair"), max_wait_s=WAIT_S, max_steps=steps, **changes)
        self.config = MatchConfig(task=task, run=RUN, assemble_s=5, record=record)
        self.game = game
        self.broker = MemoryBroker()
        self.seen: list[Wire] = []

    async def play(self, stalkers: Decide, *more: Awaitable[object]) -> Result:
        stalker_bus = self.broker.session()
        self.stalker_bus = stalker_bus
        tasks = [
            asyncio.ensure_future(run_worker(stalker_bus, RUN, "blue", "Stalkers", FunctionPolicy(stalkers))),
            asyncio.ensure_future(run_worker(self.broker.session(), RUN, "blue", "Zealots", FunctionPolicy(attack))),
            *(asyncio.ensure_future(work) for work in more),
        ]
        try:
            (result,) = await host(self.config, self.game, self.broker.session(), watch=self.seen.append)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
        return result

    @property
    def reports(self) -> list[Report]:
        return [message for message in self.seen if isinstance(message, Report)]

    def statuses(self, agent: str) -> list[str]:
        return [a.status for report in self.reports for a in report.agents if a.agent == agent]


def attack(_: Briefing, seen: Observation) -> str:
    teams = []
    for team in seen.view.teams:
        target = f"<Attack_Unit({team.enemies[0].tag})>" if team.enemies else ""
        teams.append(f"Team {team.name}:\n{target}")
    return "Actions:\n" + "\n".join(teams)


async def test_both_agents_play_and_their_calls_are_executed_in_one_step(game: Sides) -> None:
    table = Table(game, steps=10)
    result = await table.play(attack)
    assert result.statuses == {"Stalkers": {"ok": 10}, "Zealots": {"ok": 10}}
    assert result.accepted == sum(len(a.accepted) for report in table.reports for a in report.agents) > 10
    assert {report.env_steps for report in table.reports} == {1}
    assert result.env_steps == result.steps
    assert max(len(report.functions) for report in table.reports) == 3


async def test_an_agent_that_stalls_is_late_and_the_game_goes_on(game: Sides) -> None:
    async def stall(_: Briefing, seen: Observation) -> str:
        if seen.step >= 2:
            await asyncio.Event().wait()
        return attack(_, seen)

    table = Table(game, steps=4)
    result = await table.play(stall)
    assert table.statuses("Zealots") == ["ok"] * 4
    # the worker gives up a moment before the host does, and reports it
    assert table.statuses("Stalkers") == ["ok", "ok", "late", "late"]
    assert result.steps == 4


async def test_an_agent_that_dies_in_a_step_is_gone_and_not_waited_for_if_the_task_says_so(game: Sides) -> None:
    table = Table(game, steps=5, faults={"agent_gone": "go_on"})

    async def die(_: Briefing, seen: Observation) -> str:
        if seen.step == 2:
            table.stalker_bus.kill()
            await asyncio.Event().wait()
        return ""

    result = await table.play(die)
    assert table.statuses("Stalkers") == ["ok", "ok", "gone", "gone", "gone"]
    assert table.statuses("Zealots") == ["ok"] * 5
    assert all(report.timings.wait_s < WAIT_S for report in table.reports)
    assert result.statuses["Stalkers"] == {"ok": 2, "gone": 3}


async def test_an_agent_that_sends_garbage_is_named_and_the_others_play(game: Sides) -> None:
    table = Table(game, steps=3)
    liar = table.broker.session()

    async def garbage(_: Briefing, seen: Observation) -> str:
        publisher = await liar.publisher(agent_key(RUN, "blue", "Stalkers", Topic.REPLY), Delivery.SPEECH)
        await publisher.put(b"\x00\xff not a reply")
        await asyncio.Event().wait()
        return ""

    await table.play(garbage)
    assert table.statuses("Stalkers") == ["malformed"] * 3
    assert "no JSON object" in table.reports[0].agents[0].detail


async def test_a_reply_that_comes_late_is_counted_and_never_executed(game: Sides, tmp_path: Path) -> None:
    table = Table(game, steps=4, record=tmp_path / "late.mcap")
    liar = table.broker.session()
    replies: list[bytes] = []

    async def late(_: Briefing, seen: Observation) -> str:
        publisher = await liar.publisher(agent_key(RUN, "blue", "Stalkers", Topic.REPLY), Delivery.SPEECH)
        for old in replies:
            await publisher.put(old)
        text = f"Actions:\nTeam Stalker-1:\n<Move_Screen([{seen.step + 1}, 1])>"
        said = Reply(run=RUN, side="blue", agent="Stalkers", episode=0, step=seen.step, text=text)
        replies.append(encode(said))
        return ""

    await table.play(late)
    stalkers = [report.agents[0] for report in table.reports]
    assert [agent.ignored for agent in stalkers] == [0, 1, 2, 3]
    assert not any(agent.accepted for agent in stalkers)
    assert not any("Move" in function for report in table.reports for function in report.functions)
    recorded = [reply.step for reply in Recording.open(tmp_path / "late.mcap").of(Reply, agent="Stalkers")]
    assert sorted(recorded) == [0, 0, 0, 0, 1, 1, 1, 2, 2, 3]  # ignored replies are recorded as well


async def test_an_action_said_twice_is_executed_once(game: Sides) -> None:
    table = Table(game, steps=3)
    liar = table.broker.session()

    async def twice(_: Briefing, seen: Observation) -> str:
        text = "Actions:\nTeam Stalker-1:\n<Move_Screen([13, 12])>"
        publisher = await liar.publisher(agent_key(RUN, "blue", "Stalkers", Topic.REPLY), Delivery.SPEECH)
        said = Reply(run=RUN, side="blue", agent="Stalkers", episode=0, step=seen.step, text=text)
        await publisher.put(encode(said))
        return text

    await table.play(twice)
    moves = [sum("Move" in function for function in report.functions) for report in table.reports]
    assert moves == [1, 1, 1]
    assert sum(report.agents[0].ignored for report in table.reports) >= 2


async def test_what_one_agent_says_the_other_reads_in_the_next_step(game: Sides) -> None:
    table = Table(game, steps=2)
    heard: list[str] = []

    def talk(_: Briefing, seen: Observation) -> str:
        heard.extend(message.text for message in seen.messages)
        return f"Communications:\n<MessageTo(Stalkers, 'step {seen.step}')>\n<MessageTo(Zealots, 'go {seen.step}')>"

    result = await table.play(talk)
    assert heard == []  # only the Stalkers write to the Stalkers
    assert [m.text for report in table.reports for m in report.messages] == ["step 0", "go 0", "step 1", "go 1"]
    assert result.rejections == {"unknown_recipient": 2}


async def test_what_agents_write_to_each_other_is_on_the_bus_and_recorded_in_its_step(
    game: Sides, tmp_path: Path
) -> None:
    table = Table(game, steps=2, record=tmp_path / "said.mcap")
    heard = await table.broker.session().subscribe(agent_key(RUN, "blue", "Stalkers", Topic.MESSAGE), Delivery.LOG)

    def talk(_: Briefing, seen: Observation) -> str:
        return f"Communications:\n<MessageTo(Zealots, 'go {seen.step}')>"

    await table.play(talk)
    recording = Recording.open(tmp_path / "said.mcap")
    for step in recording.by_step():
        (said,) = step.of(Message)
        (report,) = step.of(Report)
        assert (said.agent, said.recipient, said.text, said.step) == (
            "Stalkers",
            "Zealots",
            f"go {step.step}",
            step.step,
        )
        assert [(m.sender, m.recipient, m.text) for m in report.messages] == [(said.agent, said.recipient, said.text)]
        assert (await anext(heard)).payload == encode(said)
    assert [[m.text for m in seen.messages] for seen in recording.observations("Zealots")] == [[], ["go 0"]]


async def test_the_default_reply_of_the_task_counts_for_an_agent_that_says_nothing(game: Sides) -> None:
    async def stall(_: Briefing, seen: Observation) -> str:
        if seen.step == 1:
            await asyncio.Event().wait()
        return "Analysis: I wait."

    table = Table(game, steps=2, default_reply="<Move_Screen([13, 12])>\n<MessageTo(Zealots, 'I am late')>")
    await table.play(stall)
    assert table.statuses("Stalkers") == ["ok", "late"]
    assert [report.agents[0].accepted for report in table.reports] == [(), ("Stalker-1 <Move_Screen([13, 12])>",)]
    assert [[m.text for m in report.messages] for report in table.reports] == [[], ["I am late"]]


async def test_the_phases_of_a_step_take_all_of_its_time(game: Sides) -> None:
    table = Table(game, steps=20)
    result = await table.play(attack)
    phases = [report.timings.model_dump(exclude={"held_s", "lag_s"}).values() for report in table.reports]
    assert all(min(phase) > 0 for phase in phases)
    assert sum(map(sum, phases)) <= result.wall_s
