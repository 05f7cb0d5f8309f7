"""A bot of python-sc2 plays against the agents on the simulator: how the game goes, and how the guest may end it."""

from __future__ import annotations

import asyncio
import importlib.util
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from khala_agents.policy import FunctionPolicy
from khala_agents.worker import run_worker
from khala_bridge.errors import GameError
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.errors import RecordingError
from khala_protocol.messages import Run
from khala_protocol.recording import Recording
from khala_protocol.trust import trust
from khala_sc2.playing import games
from khala_sc2.playing.hosting import game_of, host_match
from khala_sc2.testing import replay_host

if TYPE_CHECKING:
    from khala_bridge.state import Snapshot
    from khala_protocol.messages import Result

pytestmark = [
    pytest.mark.game,
    pytest.mark.slow,
    pytest.mark.skipif(not importlib.util.find_spec("sc2"), reason="burnysc2 is not installed: run `make install`"),
]

BOT = Path(__file__).with_name("ladder_bot.py")


def match(kind: str, record: Path, *, episodes: int = 1, wait_s: float = 60.0, **changes: Any) -> MatchConfig:
    command = [sys.executable, str(BOT), kind]
    trust(shlex.join(command))
    guest = {"kind": "guest", "command": command, "wait_s": wait_s}
    task = change(load_task("simple64_eceb_terran"), opponent=guest, **changes)
    return MatchConfig(task=task, run="guest", record=record, episodes=episodes)


async def to_the_end(config: MatchConfig, loops: int = 22) -> list[tuple[Snapshot, str]]:
    """Return the last snapshot of each episode in which the agents do nothing, and who the opponent was."""
    sc2path, _ = games.find("simulator")
    ends = []
    async with game_of(config, sc2path) as game:
        for _ in range(config.episodes):
            (now,) = await game.reset()
            while not now.ended:
                (result,) = await game.act([()], loops)
                now = result.snapshot
            ends.append((now, game.info.opponent))
    return ends


async def play(config: MatchConfig) -> list[Result]:
    """Play a match whose agents say nothing."""
    sc2path, name = games.find("simulator")
    broker = MemoryBroker()
    agents = [
        asyncio.create_task(
            run_worker(broker.session(), config.run, "blue", agent.name, FunctionPolicy(lambda *_: "Actions:"))
        )
        for agent in config.task.agents
    ]
    try:
        return await host_match(config.model_copy(update={"game": name}), sc2path, broker.session())
    finally:
        for agent in agents:
            agent.cancel()
        await asyncio.gather(*agents, return_exceptions=True)


async def test_a_whole_match_is_lost_to_a_worker_rush_and_named_and_not_played_again(tmp_path: Path) -> None:
    record = tmp_path / "recording.mcap"
    (result,) = await play(match("rush", record, max_wait_s=30, step_loops=44))
    assert (result.outcome, result.cause, result.valid) == ("loss", "defeated", True)
    assert result.opponent == "guest bot rush, zerg"
    assert "result Result.Victory" in (tmp_path / "guest.log").read_text()
    recording = Recording.open(record)
    (card,) = recording.of(Run)
    assert card.opponent == "guest bot rush, zerg"
    with pytest.raises(RecordingError, match="against a guest bot rush, zerg, whose decisions are not recorded"):
        await replay_host(record)


@pytest.mark.parametrize(
    ("kind", "forfeit", "before_loop"),
    [("quitter", "guest left", 120), ("crash", "guest gone", 60), ("thinker", "guest hung", 60)],
)
async def test_a_guest_that_goes_away_loses(kind: str, forfeit: str, before_loop: int, tmp_path: Path) -> None:
    ((end, opponent),) = await to_the_end(match(kind, tmp_path / "r.mcap", wait_s=15))
    assert (end.outcome, end.forfeit, opponent) == ("win", forfeit, f"guest bot {kind}, zerg")
    assert end.game_loop < before_loop


async def test_each_episode_is_played_against_a_new_process_of_the_guest(tmp_path: Path) -> None:
    ends = await to_the_end(match("quitter", tmp_path / "r.mcap", episodes=2))
    assert [(end.outcome, end.forfeit) for end, _ in ends] == [("win", "guest left")] * 2


async def test_a_guest_that_ends_before_it_joins_is_quoted(tmp_path: Path) -> None:
    with pytest.raises(GameError, match=r"^the guest ended with code 1 before it joined: .*KeyError: 'nobody'$"):
        await to_the_end(match("nobody", tmp_path / "r.mcap"))
