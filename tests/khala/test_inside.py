"""A game in this process plays what the game's own process plays, and its faults are its own."""

from __future__ import annotations

from contextlib import closing
from typing import TYPE_CHECKING, Any

import pytest

from khala.playing.inside import InsideGames
from khala.playing.seats import SeatedMatch, seats_of
from khala_bridge.compat import protocol
from khala_bridge.errors import GameError
from khala_bridge.game.inside import InsideProcess
from khala_bridge.game.processes import settle_flags
from khala_orchestrator.config import MatchConfig, load_task
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
    answers = Session.handle
    broken: list[Session] = []

    def handle(self: Session, data: bytes) -> bytes:
        if self in broken:
            raise ZeroDivisionError("a fault of the simulator")
        return answers(self, data)

    monkeypatch.setattr(Session, "handle", handle)
    with closing(InsideGames()) as games:
        taken: list[Any] = []
        take = games.take
        monkeypatch.setattr(games, "take", lambda path: taken.append(take(path)) or taken[-1])
        async with match(games, seed=1) as healthy:
            failing = match(games, seed=2)
            await healthy.turn()
            with pytest.raises(GameError, match="ZeroDivisionError|a fault of the simulator"):
                async with failing:
                    turn = await failing.turn()
                    line = taken[1].controller._client._sock
                    broken.append(line._answer.__self__)
                    for seat in turn.asked:
                        failing.act(seat, "")
                    await failing.turn()
            for seat in (await healthy.turn()).asked:
                healthy.act(seat, "")
            assert (await healthy.turn()).asked


def test_a_game_that_was_killed_answers_no_more() -> None:
    settle_flags()
    process = InsideProcess(Session(".").handle)
    assert process.running
    assert process.controller.ping().game_version.startswith("4.10")
    process.kill()
    assert not process.running
    with pytest.raises(protocol.ConnectionError, match="the game in this process has ended"):
        process.controller.ping()
    process.close()
