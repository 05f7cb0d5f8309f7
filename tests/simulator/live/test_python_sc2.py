"""Unmodified python-sc2 (burnysc2) plays on an install of the simulator, alone and over LAN."""

import importlib.util
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from khala_simulator.process.install import install

pytestmark = [
    pytest.mark.game,
    pytest.mark.skipif(not importlib.util.find_spec("sc2"), reason="burnysc2 is not installed: run `make install`"),
]

BOTS = Path(__file__).with_name("python_sc2_bots.py")


def play(game: str, directory: Path) -> dict[str, Any]:
    """Return what the bots saw of a game."""
    out = directory / "seen.json"
    run = subprocess.run([sys.executable, str(BOTS), game, str(out)], capture_output=True, timeout=100, check=False)
    assert run.returncode == 0, (run.stdout + run.stderr).decode()
    seen: dict[str, Any] = json.loads(out.read_text())
    return seen


@pytest.mark.slow
@pytest.mark.usefixtures("sc2", "no_process_left")
def test_a_bot_settles_on_a_melee_map(tmp_path: Path) -> None:
    seen = play("melee", tmp_path)
    assert seen["result"] == ["Defeat"]  # it gave up
    assert seen["start"] == [12, 1, 50, 12]
    assert seen["expansions"] >= 4
    assert seen["path"] > 50  # the start locations are 66 apart as the crow flies
    assert {"MOVE_MOVE", "ATTACK_ATTACK", "STOP_STOP"} <= set(seen["abilities"])
    assert seen["chat"] == ["gl hf"]
    assert seen["moves"]
    assert seen["errors"] == 0
    walked = sum((a - b) ** 2 for a, b in zip(seen["from"], seen["to"], strict=True)) ** 0.5
    assert 15 < walked < 45  # 60 steps of 4 loops at 2.8 a second


@pytest.mark.slow
@pytest.mark.usefixtures("sc2", "no_process_left")
def test_bots_know_their_ramps_and_expand_on_either_start_of_a_map_without_fog(tmp_path: Path) -> None:
    seen = play("two bases", tmp_path)
    assert seen["result"] == ["Victory", "Defeat"]
    assert seen["expanded"] == [1, 2]
    assert seen["expansions"] == [4, 4]
    assert sorted((upper, depots) for _, upper, depots in seen["ramps"]) == [(2, 2), (5, 2)]
    assert all(away < 25 for away, _, _ in seen["ramps"])


@pytest.mark.slow
def test_a_bot_plays_version_5_0_13(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SC2PATH", str(install(tmp_path / "sc2", "5.0.13")))
    seen = play("melee", tmp_path)
    assert (seen["build"], seen["overcharge"], seen["result"]) == (92440, True, ["Defeat"])


@pytest.mark.slow
@pytest.mark.usefixtures("sc2", "no_process_left")
def test_a_bot_fights_a_battle_to_its_end(tmp_path: Path) -> None:
    seen = play("combat", tmp_path)
    assert seen["result"][0] in {"Victory", "Defeat"}
    assert seen["first enemies"] == 5
    assert seen["killed"] > 0
    assert seen["destroyed"] >= 5


@pytest.mark.slow
@pytest.mark.usefixtures("sc2", "no_process_left")
def test_the_replay_of_a_bot_is_watched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    replays = tmp_path / "Documents/StarCraft II/Replays"  # the only place from which python-sc2 plays them on Linux
    replays.mkdir(parents=True)
    played = play("combat", replays)
    seen = play("replay", replays)
    assert seen["map"] == "2s3z"
    assert seen["units"] == 10
    assert abs(seen["loop"] - played["loop"]) <= 4


@pytest.mark.usefixtures("sc2", "no_process_left")
def test_two_bots_fight_over_lan(tmp_path: Path) -> None:
    seen = play("two bots", tmp_path)
    assert seen["result"] in (["Victory", "Defeat"], ["Defeat", "Victory"])
    assert seen["killed"] > 0
    assert set(seen["types"]) <= {"STALKER", "ZEALOT"}


@pytest.mark.slow
@pytest.mark.parametrize("game", ["a quitter", "real time"])
@pytest.mark.usefixtures("sc2", "no_process_left")
def test_a_bot_wins_over_lan_when_the_other_one_gives_up(game: str, tmp_path: Path) -> None:
    seen = play(game, tmp_path)
    assert seen["result"] == ["Victory", "Defeat"]
    assert seen["quit at"] >= 80
