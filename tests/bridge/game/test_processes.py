"""Processes of the game that wait for a match, without a game."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import pytest

from khala_bridge.game.processes import IdleGames

SC2 = Path("/sc2")


class Process:
    """What PySC2 has of a process of the game."""

    def __init__(self, *, running: bool = True, leaves: bool = True) -> None:
        self.running, self.leaves = running, leaves
        self.closed = False
        self.controller = SimpleNamespace(leave=self._leave)

    def _leave(self) -> None:
        if not self.leaves:
            raise ConnectionError

    def close(self) -> None:
        self.closed = True


def test_the_process_that_waited_least_is_taken_by_a_match_of_its_install() -> None:
    games, first, second = IdleGames(most=2), Process(), Process()
    assert games.take(SC2) is None
    assert games.keep(first, SC2)
    assert games.keep(second, SC2)
    assert games.take(Path("/another")) is None
    assert [games.take(SC2), games.take(SC2), games.take(SC2)] == [second, first, None]


@pytest.mark.parametrize("process", [Process(running=False), Process(leaves=False)], ids=["dead", "cannot leave"])
def test_what_cannot_be_played_on_is_left_to_its_taker(process: Process) -> None:
    assert not IdleGames().keep(process, SC2)
    assert not process.closed


def test_no_more_wait_than_there_is_room_for_and_none_after_the_end() -> None:
    waits = Process()
    with closing(IdleGames(most=1)) as games:
        assert games.keep(waits, SC2)
        assert not games.keep(Process(), SC2)
    assert waits.closed
    assert not games.keep(Process(), SC2)


def test_a_process_that_died_while_it_waited_is_not_taken() -> None:
    games, process = IdleGames(), Process()
    games.keep(process, SC2)
    process.running = False
    assert games.take(SC2) is None
    assert process.closed
