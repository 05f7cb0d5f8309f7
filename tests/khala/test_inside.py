"""A game in this process plays what the game's own process plays, and its faults are its own."""

from __future__ import annotations

from contextlib import closing
from typing import TYPE_CHECKING

import pytest
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.compat import protocol
from khala_bridge.errors import GameError
from khala_bridge.game.inside import InsideProcess
from khala_bridge.game.processes import settle_flags
from khala_orchestrator.config import MatchConfig, load_task
from khala_sc2.playing.inside import InsideGames
from khala_sc2.playing.seats import SeatedMatch, seats_of
from khala_simulator.process.session import Session

if TYPE_CHECKING:
    from khala_bridge.game.processes import Processes

pytestmark = pytest.mark.game


def match(processes: Processes | None, *, seed: int = 3, steps: int = 3) -> SeatedMatch:
    task = load_task("2s3z").model_copy(update={"max_steps": steps})
    config = MatchConfig(task=task, run=f"inside-{seed}", seed=seed)
    return SeatedMatch(config, seats_of(task), processes=processes)


async def texts(playing: SeatedMatch) -> list[str]:
    """Return what the agent reads of a match in which it only attacks."""
    read: list[str] = []
    async with playing:
        while not (turn := await playing.turn()).over:
            for seat, seen in turn.asked.items():
                read.append(seen.observation.text)
                playing.act(seat, "Actions:\nTeam Zealot-1:\n<Attack_Minimap([40, 32])>")
    return read


async def test_a_game_in_this_process_plays_as_in_a_process_of_its_own() -> None:
    with closing(InsideGames()) as games:
        assert await texts(match(games)) == await texts(match(None))


async def test_a_fault_in_a_game_ends_its_match_and_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    answer = Session.handle
    sessions: list[Session] = []

    def handle(self: Session, data: bytes) -> bytes:
        if self not in sessions:
            sessions.append(self)
        if self is not sessions[0] and sc_pb.Request.FromString(data).HasField("step"):
            raise ZeroDivisionError("a fault of the simulator")
        return answer(self, data)

    monkeypatch.setattr(Session, "handle", handle)
    with closing(InsideGames()) as games:
        async with match(games, seed=1) as healthy:
            turn = await healthy.turn()
            with pytest.raises(GameError, match="a fault of the simulator"):
                await texts(match(games, seed=2))
            for seat in turn.asked:
                healthy.act(seat, "")
            assert (await healthy.turn()).asked


def test_a_game_that_was_killed_answers_no_more() -> None:
    settle_flags()
    process = InsideProcess(Session(".").handle)
    assert process.controller.ping().game_version.startswith("4.10")
    process.kill()
    with pytest.raises(protocol.ConnectionError, match="the game in this process has ended"):
        process.controller.ping()
    process.close()
