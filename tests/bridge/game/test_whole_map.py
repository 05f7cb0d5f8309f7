"""The whole map of a game on the simulator, for those who watch: what it has, and that no player notices it."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any

import pytest
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.act import PlanResult, PlanStep
from khala_bridge.compat import protocol
from khala_bridge.errors import GameError
from khala_bridge.game.game import GameConfig
from khala_bridge.game.pysc2_game import PySC2Game
from khala_bridge.state.requests import unit_order
from khala_bridge.task.maps import known_maps
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from khala_bridge.act import Plan
    from khala_bridge.state import Snapshot

pytestmark = pytest.mark.game

ATTACK = 3674
STEPS = 24


@pytest.fixture(scope="module")
def sc2path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install(tmp_path_factory.mktemp("sc2"))


@pytest.fixture(scope="module")
def game(sc2path: Path) -> Iterator[PySC2Game]:
    with started(sc2path) as game:
        yield game


@contextlib.contextmanager
def started(sc2path: Path, played: str = "Simple64") -> Iterator[PySC2Game]:
    game = PySC2Game(GameConfig(sc2path=sc2path, map=known_maps()[played], seed=3))
    try:
        yield game
    finally:
        game.close()


def attack(now: Snapshot) -> Plan:
    """Send everybody to where the other player begins."""
    start = now.info.starts[0]
    yield PlanStep((unit_order(ATTACK, [unit.tag for unit in now.own], start),), 40)
    return PlanResult()


def observations(game: PySC2Game, look: Callable[[], object]) -> list[bytes]:
    """Return what the player is told in a game, as bytes, while `look` is called in each step."""
    (now,), told = game.reset(), []
    for _ in range(STEPS):
        look()
        (result,) = game.act([attack(now)])
        now = result.snapshot
        told.append(game._env._obs[0].SerializeToString(deterministic=True))
    return told


def test_it_has_what_the_player_does_not_see(game: PySC2Game) -> None:
    (now,) = game.reset()
    whole = game.whole()
    assert whole is not None
    assert not [unit for unit in now.known.values() if unit.is_enemy]
    enemies = [unit for unit in whole.known.values() if unit.is_enemy]
    assert len([unit for unit in enemies if unit.facts is not None and unit.facts.worker]) == 12
    assert [unit.pos for unit in enemies if unit.is_structure] == [*now.info.starts]
    assert {unit.tag: unit for unit in whole.own} == {unit.tag: unit for unit in now.own}
    assert not any(unit.is_remembered for unit in whole.known.values())


@pytest.mark.slow
def test_no_byte_of_what_a_player_is_told_depends_on_it(sc2path: Path) -> None:
    with started(sc2path) as game:
        without = observations(game, lambda: None)
    with started(sc2path) as game:
        assert observations(game, game.whole) == without


class Answers:
    """The connection to a game that answers the look without fog in its own way."""

    def __init__(self, client: Any, answer: Callable[[], Any]) -> None:
        self._client, self._answer = client, answer

    def __getattr__(self, name: str) -> Any:
        return getattr(self._client, name)

    def send(self, **request: Any) -> Any:
        wanted = request.get("observation")
        return self._answer() if wanted is not None and wanted.disable_fog else self._client.send(**request)


@contextlib.contextmanager
def answering(game: PySC2Game, answer: Callable[[Any], Any]) -> Iterator[None]:
    controller = game._env._controllers[0]
    client = controller._client
    controller._client = Answers(client, lambda: answer(client))
    try:
        yield
    finally:
        controller._client = client


def refuse(_: Any) -> Any:
    raise protocol.ProtocolError("disable_fog is not supported")


def ignore(client: Any) -> Any:
    return client.send(observation=sc_pb.RequestObservation())


def die(_: Any) -> Any:
    raise protocol.ConnectionError("Connection already closed")


def test_a_game_that_refuses_is_asked_once_and_goes_on(sc2path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with started(sc2path) as game:
        (now,) = game.reset()
        with answering(game, refuse):
            assert (game.whole(), game.whole()) == (None, None)
        assert [record.message for record in caplog.records if "whole map" in record.message] == [
            "the game does not show the whole map; scenes have what the sides see: disable_fog is not supported"
        ]
        assert game.whole() is None
        (result,) = game.act([attack(now)])
        assert result.snapshot.game_loop == 40


def test_a_game_that_ignores_the_wish_shows_no_whole_map(game: PySC2Game) -> None:
    game.reset()
    with answering(game, ignore):
        assert game.whole() is None


def test_a_game_that_dies_of_it_is_an_error(game: PySC2Game) -> None:
    game.reset()
    with answering(game, die), pytest.raises(GameError, match="died when it was asked for the whole map"):
        game.whole()


@pytest.mark.slow
def test_there_is_none_of_a_game_that_is_over(sc2path: Path) -> None:
    with started(sc2path, "2s3z") as game:
        game.reset()
        game._ended = True
        assert game.whole() is None
