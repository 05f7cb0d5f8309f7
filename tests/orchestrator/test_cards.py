"""What agents and everybody else are told before the first step."""

from __future__ import annotations

import importlib.metadata
import platform
import re
from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.catalogue.catalogue import catalogue_sha256
from khala_bridge.game.game import GameIdentity
from khala_bridge.task.config import TaskConfig
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_orchestrator.match.cards import briefing, run_card
from khala_protocol.messages import AgentCard, Clock, Contact, Frames, TeamSpec
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_protocol.messages import Briefing


def changed(**fields: Any) -> TaskConfig:
    """A task of two agents, with some fields replaced; those of `agents` by name."""
    task = load_task("2s3z_pair")
    agents = fields.pop("agents", {})
    data = task.model_dump() | fields
    data["agents"] = [agent | agents.get(agent["name"], {}) for agent in data["agents"]]
    return TaskConfig.model_validate(data)


def told(agent: str, **fields: Any) -> Briefing:
    task = changed(**fields)
    return briefing(task, task.agent(agent), "test", 2, 3)


def test_an_agent_is_told_who_it_is_and_what_it_may_do() -> None:
    found = told("Zealots", side="red", clock=Clock(max_wait_s=7, step_loops=11), frames=Frames(screen=32.0))
    assert (found.run, found.side, found.agent, found.episode) == ("test", "red", "Zealots", 2)
    assert found.role.startswith("You command the Zealots, the front line of a small army.")
    assert found.teams == (
        TeamSpec(name="Zealot-1", unit_types=("Zealot",)),
        TeamSpec(name="Zealot-2", unit_types=("Zealot",)),
    )
    assert [action.name for action in found.actions] == ["Attack_Unit", "Move_Screen", "Hold_Position"]
    assert (found.clock, found.frames) == (Clock(max_wait_s=7, step_loops=11), Frames(screen=32.0))


def test_the_task_of_all_stands_before_its_own(subtests: pytest.Subtests) -> None:
    for of_all, own, said in (
        ("Win.", "Stand fast.", "Win.\nStand fast."),
        ("Win.", "", "Win."),
        ("", "Stand fast.", "Stand fast."),
    ):
        with subtests.test(of_all=of_all, own=own):
            assert told("Zealots", task=of_all, agents={"Zealots": {"task": own}}).task == said


def test_its_own_number_of_actions_counts_before_that_of_the_task() -> None:
    assert told("Zealots", max_actions=5).max_actions == 5
    assert told("Zealots", max_actions=5, agents={"Zealots": {"max_actions": 1}}).max_actions == 1


def test_it_is_told_of_those_that_it_may_write_to(subtests: pytest.Subtests) -> None:
    stalkers = Contact(name="Stalkers", role=load_task("2s3z_pair").agent("Stalkers").role)
    changes: dict[str, tuple[dict[str, Any], tuple[Contact, ...], tuple[str, ...]]] = {
        "all others": ({}, (stalkers,), ("Channel-1",)),
        "those that are named": ({"agents": {"Zealots": {"talks_to": ("Stalkers",)}}}, (stalkers,), ("Channel-1",)),
        "nobody": ({"agents": {"Zealots": {"talks_to": ()}}}, (), ()),
        "without communication": ({"communication": False}, (), ()),
    }
    for name, (fields, correspondents, channels) in changes.items():
        with subtests.test(name):
            found = told("Zealots", **fields)
            assert (found.correspondents, found.channels) == (correspondents, channels)


def test_the_run_card_says_what_repeats_the_run(config: Callable[..., MatchConfig]) -> None:
    match = config(episodes=3).model_copy(update={"seed": 7, "game": "Khala simulator 0.1.0, as"})
    card = run_card(match, GameIdentity("4.10.0.75689", "B89B", "2s3z.SC2Map", "ab" * 32))
    assert (card.run, card.task, card.map_name, card.map_sha256) == ("test", "2s3z_pair", "2s3z", "ab" * 32)
    assert (card.seed, card.episodes, card.executor) == (7, 3, "raw")
    assert card.game == "Khala simulator 0.1.0, as 4.10.0.75689"
    assert card.clock == Clock(max_wait_s=10.0, step_loops=11)
    assert card.agents == (
        AgentCard(name="Stalkers", side="blue", teams=("Stalker-1",)),
        AgentCard(name="Zealots", side="blue", teams=("Zealot-1", "Zealot-2")),
    )
    assert card.catalogue_sha256 == catalogue_sha256()
    assert TaskConfig.model_validate(card.config) == match.task
    assert (card.variant, card.played_task) == ("files", "2s3z_pair")


def test_the_run_card_names_the_variant_of_the_paper(config: Callable[..., MatchConfig]) -> None:
    task = change(load_task("pvz_task3_level1"), variant="paper")
    match = config().model_copy(update={"task": task})
    card = run_card(match, GameIdentity("4.10", "B", "m", "0"))
    assert (card.task, card.variant, card.map_name) == ("pvz_task3_level1", "paper", "pvz_task3_level1_paper")
    assert card.played_task == "pvz_task3_level1 (variant paper)"
    assert TaskConfig.model_validate(card.config) == task


@pytest.mark.parametrize(
    ("task", "opponent", "met", "against"),
    [
        ("simple64_eceb_terran", None, "", "computer (zerg, easy)"),
        ("simple64_eceb_terran", "guest", "guest bot Rush, zerg", "guest bot Rush, zerg"),
        ("simple64_eceb_terran", "lan", "", "player over LAN at 127.0.0.1:14380"),
        ("MoveToBeacon", None, "", "nobody"),
        ("duel_3m", None, "", ""),
    ],
)
def test_the_run_card_names_the_opponent(task: str, opponent: str | None, met: str, against: str) -> None:
    match = MatchConfig(task=change(load_task(task), opponent=opponent), run="r")
    assert run_card(match, GameIdentity("4.10", "B", "m", "0", met)).opponent == against


def test_the_run_card_names_the_versions_that_numbers_depend_on(config: Callable[..., MatchConfig]) -> None:
    versions = run_card(config(), GameIdentity("4.10", "B", "m", "0")).versions
    assert list(versions) == ["python", "khala", "pysc2", "eclipse-zenoh", "pydantic", "protobuf", "numpy"]
    assert versions["python"] == platform.python_version()
    assert versions["numpy"] == importlib.metadata.version("numpy")


def test_the_example_of_every_agent_uses_what_that_agent_has(subtests: pytest.Subtests) -> None:
    missing = []
    for name in ("2s3z", "pvz_task6_level1", "simple64_eceb", "simple64_ecsb", "simple64_sceb"):
        task = load_task(name)
        for agent in task.agents:
            told = briefing(task, agent, "test", 0)
            if told.example is None:
                missing.append(f"{name}/{agent.name}")
                continue
            with subtests.test(task=name, agent=agent.name):
                speech = parse(told.example.reply)
                assert speech.faults == ()
                assert {call.name for call in speech.calls} <= {action.name for action in told.actions}
                assert {said.recipient for said in speech.messages} <= {other.name for other in told.correspondents}
                tags = re.findall(r"0x\w+", told.example.reply)
                assert all(f"{tag} " in told.example.observation for tag in tags)
    assert missing == []
