"""Pages of games that the simulator plays: three races, every kind of agent."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import pytest
from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_agents.scripted.reading import read
from khala_bridge.knowledge import facts_of, knowledge
from khala_bridge.names import unit_name
from khala_bridge.observe import Observer
from khala_bridge.observe.text import SECTIONS_OF, tokens
from khala_bridge.state import Snapshot, read_info, read_snapshot
from khala_bridge.state.abilities import available, question
from khala_bridge.task.config import TaskConfig
from khala_simulator.process.client import Client, command, interface

if TYPE_CHECKING:
    from khala_bridge.observe import SideObservation

RACES = {"protoss": common_pb2.Protoss, "terran": common_pb2.Terran, "zerg": common_pb2.Zerg}
WORKERS = {"protoss": "Probe", "terran": "SCV", "zerg": "Drone"}
LOOPS = 200


def everybody(race: str) -> TaskConfig:
    """Return an agent of each kind; the first worker builds, the next one fights."""
    worker = WORKERS[race]
    side = [{"name": "Side", "kind": "side", "actions": [f"group:train/{race}", f"group:easy-build/{race}"]}]
    own = [{"name": "Worker", "unit_types": [worker]}]
    actions = {worker: ["group:basic", f"group:build/{race}"]}
    agents: list[dict[str, Any]] = [
        {"name": "Commander", "kind": "commander", "teams": side},
        {"name": "Developer", "kind": "developer", "teams": side},
        {"name": "Builder", "kind": "builder", "admits": "builder", "teams": own, "actions": actions},
        {"name": "Fighter", "kind": "combat_group", "teams": own, "actions": actions, "text_tokens": 550},
    ]
    task = {"name": race, "own_map": {"file": "Simple64", "race": race, "opponent": "terran"}, "task": "Win."}
    return TaskConfig.model_validate({**task, "agents": [{"role": "You play.", **agent} for agent in agents]})


@pytest.fixture(scope="module", params=sorted(RACES))
def game(request: pytest.FixtureRequest) -> tuple[TaskConfig, list[SideObservation]]:
    """Return what the agents see at the beginning of a game, and some seconds later, with a worker in training."""
    task = everybody(request.param)
    client = Client()
    client.ask(
        create_game=sc_pb.RequestCreateGame(
            local_map=sc_pb.LocalMap(map_path="Simple64"),
            player_setup=[
                sc_pb.PlayerSetup(type=sc_pb.Participant),
                sc_pb.PlayerSetup(type=sc_pb.Computer, race=common_pb2.Terran, difficulty=sc_pb.VeryEasy),
            ],
            random_seed=1,
        )
    )
    client.ask(join_game=sc_pb.RequestJoinGame(race=RACES[request.param], options=interface(screen=0)))
    info = client.ask(game_info=sc_pb.RequestGameInfo()).game_info
    observer, observations = Observer(task), []
    for _ in range(2):
        response = client.observe()
        blind = read_snapshot(response, read_info(info, facts_of("multi")))
        answer = client.ask(query=question(blind)).query
        snapshot = read_snapshot(response, blind.info, abilities=available(answer))
        observations.append(observer.observe(snapshot))
        tuple(observations[-1].agents.values())  # while it is the present one
        _train_a_worker(client, snapshot)
        client.step(LOOPS)
    return task, observations


def _train_a_worker(client: Client, snapshot: Snapshot) -> None:
    for unit in snapshot.own:
        facts = knowledge()[unit_name(unit.unit_type)]
        made = (number for name in WORKERS.values() for number in knowledge()[name].made_by)
        ability = next((number for number in made if number in facts.ability_ids), None)
        if ability is not None:
            client.act(command(ability, (unit.tag,)))
            return


def test_every_kind_of_agent_reads_a_page(game: Any) -> None:
    task, observations = game
    assert {agent.kind for agent in task.agents} == SECTIONS_OF.keys()
    for observation in observations:
        for agent in observation.agents.values():
            headings = re.findall(r"^\S.*$", agent.text, re.MULTILINE)
            assert "Game" in headings
            assert headings[-1] == "Answer"
            assert "Valid actions" in headings


def test_a_program_reads_of_it_what_the_view_says(game: Any) -> None:
    _, observations = game
    for agent in observations[-1].agents.values():
        situation = read(agent.text)
        for team in agent.view.teams:
            seen = situation.teams[team.name]
            assert [unit.tag for unit in seen.own] == [unit.tag for unit in team.units]
            assert [action.name for action in seen.actions] == [action.name for action in team.actions]


def test_what_is_trained_is_told(game: Any) -> None:
    task, observations = game
    worker = WORKERS[task.name]
    text = observations[-1].agents["Developer"].text
    assert re.search(rf"(?m)^    In production: .*Train_{worker} \(1 at \d+%", text) or f"Finished: 1 {worker}" in text


def test_workers_and_structures_are_counted(game: Any) -> None:
    task, observations = game
    counts = observations[0].agents["Commander"].view.counts
    units = {count.type: count.ready for count in counts.units}
    assert units[WORKERS[task.name]] == 12
    assert [count.ready for count in counts.structures] == [1]


def test_a_builder_is_told_where_a_base_could_stand(game: Any) -> None:
    _, observations = game
    marks = observations[0].agents["Builder"].view.landmarks
    assert sum(mark.what == "base place" for mark in marks) >= 1
    assert sum(mark.what == "geyser" for mark in marks) == 2


def test_a_page_keeps_to_its_budget_in_a_game(game: Any) -> None:
    _, observations = game
    text = observations[-1].agents["Fighter"].text
    assert tokens(text) <= 550 or "only the nearest enemies are told one by one" in text
    assert "Left out to keep this short" in text
