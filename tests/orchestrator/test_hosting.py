"""A game that dies is started again, and the match goes on in it; on a clock that jumps, with games that are none."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.errors import GameError, GameMissing
from khala_orchestrator.past.resume import RESUMED
from khala_protocol.messages import Observation, Report
from khala_protocol.recording import Recording
from khala_sc2.playing.hosting import MAX_RESTARTS, host_match

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Sequence

    from khala_bridge.act import Plan
    from khala_bridge.game.game import Game, GameIdentity, Sides, StepResult
    from khala_bridge.state import Snapshot
    from khala_orchestrator.config import MatchConfig
    from khala_protocol.messages import Result
    from tests.orchestrator.conftest import Hall, Peer, StillGame

    MakeConfig = Callable[..., MatchConfig]
    MakeGame = Callable[..., StillGame]
    Start = Callable[[Any], Awaitable[Sides]]

CLOCK = "jumps"

GAME = "Khala simulator 0.1.0, as"
FOR_EVER = 1000


@dataclass
class Mortal:
    """A game that dies after some calls."""

    game: Game
    calls: int
    error: Exception = field(default_factory=lambda: GameError("the game died"))

    @property
    def info(self) -> GameIdentity:
        return self.game.info

    def reset(self) -> tuple[Snapshot, ...]:
        self._live()
        return self.game.reset()

    def act(self, plans: Sequence[Plan]) -> tuple[StepResult, ...]:
        self._live()
        return self.game.act(plans)

    def whole(self) -> Snapshot | None:
        return self.game.whole()

    def kill(self) -> None:
        self.game.kill()

    def close(self) -> None:
        self.game.close()

    def _live(self) -> None:
        self.calls -= 1
        if self.calls < 0:
            raise self.error


@dataclass
class Stable:
    """Where games are started, one after the other, and played by `hosted`."""

    hall: Hall
    games: list[Sides]
    episodes: list[int] = field(default_factory=list)
    """With which each game began."""

    async def play(self, config: MatchConfig) -> list[Result]:
        async def by(config: MatchConfig, _: Sides, *arguments: Any, **options: Any) -> list[Result]:
            return await host_match(config, Path(), *arguments, **options)

        async def attack(peer: Peer, seen: Observation) -> None:
            await peer.answer(seen, f"Team Stalker-1:\n<Attack_Unit(0xb)>\n<MessageTo(Zealots, '{seen.step}')>")

        return await self.hall.play(config, by=by, Stalkers=attack)

    def next_game(self, *_: Any, first_episode: int, **__: Any) -> Sides:
        self.episodes.append(first_episode)
        return self.games.pop(0)


@pytest.fixture
def stable(
    hall: Hall, start: Start, still_game: MakeGame, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., Awaitable[Stable]]:
    """Makes games that die after these numbers of calls."""

    async def make(*calls: int, **how: Any) -> Stable:
        games = [await start(Mortal(still_game(), number, **how)) for number in calls]
        stable = Stable(hall, games)
        monkeypatch.setattr("khala_sc2.playing.hosting.game_of", stable.next_game)
        return stable

    return make


def steps(path: Path) -> list[tuple[int, int]]:
    return [(report.episode, report.step) for report in Recording.open(path).of(Report)]


def lost(directory: Path) -> list[str]:
    return sorted(path.name for path in directory.glob("*lost*"))


EVERY_STEP = [(episode, step) for episode in range(2) for step in range(3)]


@pytest.mark.parametrize(
    ("calls", "episode", "played"),
    [(0, 0, 0), (3, 0, 2), (4, 1, 3), (6, 1, 4)],
    ids=["at the first reset", "in a step", "between two episodes", "in the second episode"],
)
async def test_a_game_that_dies_is_started_again_and_nothing_is_lost(
    stable: Callable[..., Awaitable[Stable]],
    config: MakeConfig,
    tmp_path: Path,
    calls: int,
    episode: int,
    played: int,
) -> None:
    match = config(game=GAME, episodes=2, record=tmp_path / "undisturbed.mcap")
    undisturbed = await (await stable(FOR_EVER)).play(match)
    path = tmp_path / "recording.mcap"
    there = await stable(calls, FOR_EVER)
    there.hall.watched.clear()
    results = await there.play(match.model_copy(update={"record": path}))
    assert there.episodes == [0, episode]
    assert [result.statuses for result in results] == [result.statuses for result in undisturbed]
    assert steps(path) == EVERY_STEP
    assert [(report.episode, report.step) for report in there.hall.reports] == EVERY_STEP
    assert [place for place, report in zip(EVERY_STEP, there.hall.reports, strict=True) if report.incidents] == [
        EVERY_STEP[played]
    ]
    assert there.hall.reports[played].incidents == (RESUMED,)
    assert steps(tmp_path / "recording.lost-1.mcap") == EVERY_STEP[:played]
    seen = [Recording.open(one).of(Observation) for one in (path, match.record or path)]
    assert [one.model_dump_json() for one in seen[0]] == [one.model_dump_json() for one in seen[1]]


async def test_a_game_that_dies_again_and_again_ends_the_match(
    stable: Callable[..., Awaitable[Stable]], config: MakeConfig, tmp_path: Path
) -> None:
    path = tmp_path / "recording.mcap"
    there = await stable(*[2] * (MAX_RESTARTS + 2))
    with pytest.raises(GameError, match="the game died"):
        await there.play(config(game=GAME, record=path))
    assert len(there.games) == 1
    assert steps(path) == [(0, 0)]
    assert lost(tmp_path) == [f"recording.lost-{number}.mcap" for number in range(1, MAX_RESTARTS + 1)]


@pytest.mark.parametrize(
    ("changes", "error"),
    [
        ({"faults": {"game_lost": "end"}}, GameError("the game died")),
        ({"game": "StarCraft II"}, GameError("the game died")),
        ({"record": None}, GameError("the game died")),
        ({}, GameMissing("there is no game")),
    ],
    ids=["the task says so", "no simulator", "no recording", "no game"],
)
async def test_a_game_that_cannot_be_started_again_ends_the_match(
    stable: Callable[..., Awaitable[Stable]],
    config: MakeConfig,
    tmp_path: Path,
    changes: dict[str, Any],
    error: GameError,
) -> None:
    there = await stable(2, FOR_EVER, error=error)
    with pytest.raises(type(error), match=str(error)):
        await there.play(config(**{"game": GAME, "record": tmp_path / "recording.mcap"} | changes))
    assert there.episodes == [0]
    assert not lost(tmp_path)
