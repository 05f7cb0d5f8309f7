"""PySC2's own tools watch replays from both sides, and its agents play by raw units alone."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from s2clientprotocol import raw_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_bridge.compat import actions, features, sc2_env
from khala_simulator.process.client import Client, command, interface

pytestmark = [pytest.mark.game, pytest.mark.slow]

TOOLS = Path(__file__).with_name("pysc2_tools.py")
ATTACK, STALKER, ZEALOT = 23, 74, 73


def run(tool: str, out: Path, *arguments: object) -> str:
    """Run one of PySC2's tools; return what it printed."""
    line = [sys.executable, str(TOOLS), tool, str(out), *map(str, arguments)]
    done = subprocess.run(line, capture_output=True, timeout=100, check=False, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture
def replay(tmp_path: Path) -> Path:
    """Return the replay of a battle that was fought to its end."""
    client = Client()
    client.play("llm_smac/2s3z.SC2Map", interface(screen=64))
    seen = client.observe()
    while not seen.player_result:
        units = seen.observation.raw_data.units
        own = [unit.tag for unit in units if unit.alliance == raw_pb2.Self]
        foe = next((unit.tag for unit in units if unit.alliance == raw_pb2.Enemy), None)
        if own and foe is not None:
            client.act(command(ATTACK, own, target=foe))
        seen = client.step(8)
    path = tmp_path / "battle.SC2Replay"
    path.write_bytes(client.ask(save_replay=sc.RequestSaveReplay()).save_replay.data)
    return path


@pytest.mark.usefixtures("sc2", "no_process_left")
def test_replay_actions_sees_a_replay_from_both_sides(replay: Path, tmp_path: Path) -> None:
    run("replay_actions", tmp_path / "found.json", replay)
    found = json.loads((tmp_path / "found.json").read_text())
    for player in ("1", "2"):
        assert found[player]["units"] == [ZEALOT, STALKER]
        assert found[player]["steps"] >= found[player]["loops"] / 8
    assert found["1"]["made"].get(str(ATTACK), 0) > 10
    assert not found["2"]["made"]


@pytest.mark.parametrize("player", [1, 2])
@pytest.mark.usefixtures("sc2", "no_process_left")
def test_play_shows_a_replay_to_its_end(replay: Path, tmp_path: Path, player: int) -> None:
    said = run("play", tmp_path / "none", replay, player)
    assert 'map_name: "2s3z"' in said
    assert "Result:  [player_id: 1" in said


@pytest.mark.usefixtures("sc2", "no_process_left")
def test_check_apm_asks_for_the_replay_of_the_game_it_is_in(tmp_path: Path) -> None:
    run("check_apm", tmp_path / "apm.json")
    apm = json.loads((tmp_path / "apm.json").read_text())
    assert apm["nothing"] < apm["stop"]


def test_without_layers_pysc2_itself_lists_no_available_actions(make_env: Callable[..., Any]) -> None:
    """So `pysc2.bin.agent`, which prints them, ends with a KeyError with any agent by raw units alone."""
    raw = features.AgentInterfaceFormat(action_space=actions.ActionSpace.RAW, use_raw_units=True)
    players = [sc2_env.Agent(sc2_env.Race.protoss), sc2_env.Bot(sc2_env.Race.random, sc2_env.Difficulty.easy)]
    env = make_env(players=players, agent_interface_format=raw)
    assert "available_actions" not in env.observation_spec()[0]
    timestep = env.reset()[0]
    assert "available_actions" not in timestep.observation
    units = timestep.observation.raw_units
    own = [unit.tag for unit in units if unit.alliance == features.PlayerRelative.SELF]
    foe = next(unit.tag for unit in units if unit.alliance == features.PlayerRelative.ENEMY)
    timestep = env.step([actions.RAW_FUNCTIONS.Attack_unit("now", own, foe)])[0]
    assert not timestep.last()
