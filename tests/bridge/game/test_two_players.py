"""Two players in one game of the simulator, through PySC2: each sees, acts, loses and ends as itself."""

from __future__ import annotations

import contextlib
import os
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.act import PlanResult, PlanStep
from khala_bridge.errors import GameError
from khala_bridge.frames import WorldPoint
from khala_bridge.game.game import GameConfig
from khala_bridge.game.pysc2_game import PySC2Game
from khala_bridge.state import Alliance
from khala_bridge.state.requests import unit_order
from khala_bridge.task.maps import MapSpec, known_maps
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from khala_bridge.act import Plan
    from khala_bridge.state import Snapshot

    Act = Callable[[Snapshot], Any]

pytestmark = pytest.mark.game

ATTACK = 3674
MIDDLE = 32.0  # of both axes of a duel's map, twice


@pytest.fixture(scope="module")
def sc2path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install(tmp_path_factory.mktemp("sc2"))


@contextlib.contextmanager
def two(sc2path: Path, played: str | MapSpec, seed: int = 1) -> Iterator[PySC2Game]:
    spec = known_maps()[played] if isinstance(played, str) else played
    game = PySC2Game(GameConfig(sc2path=sc2path, map=spec, players=2, seed=seed))
    try:
        yield game
    finally:
        game.close()


def wait(_: Snapshot) -> Any:
    return ()


def cross(now: Snapshot) -> Any:
    """Attack everything on the way to the other side."""
    if now.game_loop:
        return ()
    own = now.own[0].pos
    return (unit_order(ATTACK, [unit.tag for unit in now.own], WorldPoint(MIDDLE - own.x, MIDDLE / 2)),)


def plan(actions: Any, loops: int) -> Plan:
    yield PlanStep(tuple(actions), loops)
    return PlanResult()


def act(game: PySC2Game, now: tuple[Snapshot, ...], *acts: Act, loops: int = 40) -> tuple[Snapshot, ...]:
    results = game.act([plan(each(snapshot), loops) for each, snapshot in zip(acts, now, strict=True)])
    return tuple(result.snapshot for result in results)


def to_the_end(game: PySC2Game, *acts: Act, loops: int = 40) -> list[tuple[Snapshot, ...]]:
    """Return all snapshots of an episode."""
    seen = [game.reset()]
    while not seen[-1][0].ended:
        seen.append(act(game, seen[-1], *acts, loops=loops))
    return seen


def enemies(now: Snapshot) -> set[int]:
    return {unit.tag for unit in now.known.values() if unit.alliance is Alliance.ENEMY}


def test_two_players_fight_to_the_end_and_again(sc2path: Path) -> None:
    with two(sc2path, "duel_3m") as game:
        first, *_, last = to_the_end(game, cross, cross, loops=80)
        again = act(game, game.reset(), wait, cross)
    assert [enemies(now) for now in first] == [{unit.tag for unit in now.own} for now in reversed(first)]
    winner, loser = sorted(last, key=lambda now: now.outcome == "loss")
    assert (winner.outcome, loser.outcome) == ("win", "loss")
    assert (winner.ended, winner.game_loop) == (loser.ended, loser.game_loop)
    assert winner.own
    assert not loser.own
    assert winner.score.killed > winner.score.lost == loser.score.killed
    assert [(now.game_loop, now.ended, len(now.own)) for now in again] == [(40, False, 3)] * 2


@pytest.mark.slow
@pytest.mark.parametrize("name", ["duel_3m", "duel_8m", "duel_2s3z"])
def test_nothing_happens_between_two_silent_players(sc2path: Path, name: str) -> None:
    with two(sc2path, name) as game:
        seen = to_the_end(game, wait, wait, loops=180)
    (first, _), (blue, red) = seen[0], seen[-1]
    assert (blue.outcome, red.outcome, blue.game_loop) == ("draw", "draw", 1440)
    assert [unit.pos for unit in blue.own] == [unit.pos for unit in first.own]
    assert not blue.dead | red.dead


@pytest.mark.slow
@pytest.mark.parametrize("mover", [0, 1])
def test_an_order_moves_the_units_of_the_player_who_gives_it(sc2path: Path, mover: int) -> None:
    acts: list[Act] = [wait, wait]
    acts[mover] = cross
    with two(sc2path, "duel_2s3z") as game:
        before = game.reset()
        after = act(game, before, *acts, loops=16)
    moved = [
        all(unit.pos != old.pos for unit, old in zip(now.own, then.own, strict=True))
        for now, then in zip(after, before, strict=True)
    ]
    assert moved == [mover == 0, mover == 1]
    assert [snapshot.player.player_id for snapshot in after] == [1, 2]


@pytest.mark.slow
def test_the_same_seed_and_orders_make_the_same_observations(sc2path: Path) -> None:
    def played() -> list[Any]:
        with two(sc2path, "duel_2s3z", seed=7) as game:
            episodes = [to_the_end(game, cross, cross, loops=22) for _ in range(2)]
        return [(s.known, s.own, s.score, s.dead, s.abilities) for seen in episodes for pair in seen for s in pair]

    assert played() == played()


@pytest.mark.slow
def test_each_player_of_a_full_game_sees_its_own_and_is_asked_about_its_own(sc2path: Path) -> None:
    protoss = known_maps()["Simple64"].model_copy(update={"opponent": "protoss"})
    with two(sc2path, protoss) as game:
        now = act(game, game.reset(), wait, wait)
    for snapshot in now:
        assert not enemies(snapshot), "both begin in the fog"
        nexus = next(unit for unit in snapshot.own if unit.name == "Nexus")
        assert snapshot.abilities is not None
        assert snapshot.abilities[nexus.tag]
        assert set(snapshot.abilities) <= {unit.tag for unit in snapshot.own}
    blue, red = now
    assert not {unit.tag for unit in blue.own} & {unit.tag for unit in red.own}


@pytest.mark.posix
@pytest.mark.slow
@pytest.mark.parametrize("dead", ["first", "second", "both"])
def test_a_game_of_two_that_loses_a_process_ends_and_leaves_none(sc2path: Path, dead: str) -> None:
    with two(sc2path, "duel_3m") as game:
        now = game.reset()
        first, second = _processes(sc2path)
        if dead == "both":
            game.kill()
        else:
            os.kill(first if dead == "first" else second, signal.SIGKILL)
        with pytest.raises(GameError):
            act(game, now, wait, wait)
    assert not _processes(sc2path)


def _processes(sc2path: Path) -> list[int]:
    """Return the processes of the game, in the order in which they were started."""
    found = []
    for directory in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if str(sc2path).encode() in (directory / "cmdline").read_bytes():
                found.append(int(directory.name))
    return sorted(found)


def test_a_map_that_is_played_alone_has_no_second_player(sc2path: Path) -> None:
    with pytest.raises(ValueError, match="MoveToBeacon is played alone"):
        GameConfig(sc2path=sc2path, map=known_maps()["MoveToBeacon"], players=2)
