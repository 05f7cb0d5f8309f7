"""Khala joins a game that PySC2's own `play_vs_agent --human` hosts."""

from __future__ import annotations

import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import portpicker
import pytest

from khala_bridge.errors import GameError
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_sc2.playing import games
from khala_sc2.playing.hosting import game_of

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = [pytest.mark.game, pytest.mark.slow]

HOST = Path(__file__).with_name("lan_host.py")


@contextmanager
def hosted(sc2path: Path, played: str, *options: str) -> Iterator[tuple[int, subprocess.Popen[bytes]]]:
    """Host a game; yield its port and the host's process."""
    port = portpicker.pick_unused_port()
    command = [sys.executable, str(HOST), "--human", "--norender", "--map", played, "--config_port", str(port)]
    person = ["--user_name", "Ann", "--user_race", "zerg", "--fps", "1000"]
    with subprocess.Popen([*command, *person, *options], env={"SC2PATH": str(sc2path)}) as host:
        try:
            yield port, host
        finally:
            host.kill()


def match(port: int, task: str = "simple64_eceb_terran", **changes: Any) -> MatchConfig:
    return MatchConfig(task=change(load_task(task), opponent=f"lan:127.0.0.1:{port}", **changes), run="lan")


@pytest.mark.parametrize("realtime", [False, True])
async def test_a_game_that_a_person_hosts_is_joined_played_and_won_when_they_leave(realtime: bool) -> None:
    sc2path, _ = games.find("simulator")
    options, rule = (["--realtime"], "realtime") if realtime else ([], "frozen")
    with hosted(sc2path, "Simple64", *options) as (port, host):
        async with game_of(match(port, rule=rule), sc2path) as game:
            await game.reset()
            assert game.info.opponent == "player Ann over LAN, zerg"
            (result,) = await game.act([()], 22)
            now = result.snapshot
            assert (now.ended, realtime or now.game_loop == 22) == (False, True)
            host.send_signal(signal.SIGINT)  # as a person ends it
            while not now.ended:
                (result,) = await game.act([()], 22)
                now = result.snapshot
    assert now.outcome == "win"


@pytest.mark.parametrize(
    ("played", "options", "error"),
    [
        ("Simple96", (), r"^the game at 127.0.0.1:\d+ is on the map Simple96, but the task is on another map"),
        ("Simple64", ("--realtime",), r"goes on in real time: play with --clock realtime"),
    ],
)
async def test_a_game_that_is_not_the_tasks_is_refused(played: str, options: tuple[str, ...], error: str) -> None:
    sc2path, _ = games.find("simulator")
    with hosted(sc2path, played, *options) as (port, _), pytest.raises(GameError, match=error):
        async with game_of(match(port), sc2path):
            pass
