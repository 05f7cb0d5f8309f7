"""When the map of a match is shown to those who watch, and what it costs a match that the game does not show it."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.errors import GameError
from khala_orchestrator.match.scenery import Scenery
from khala_orchestrator.match.schedule import StepId
from khala_protocol.bus import Delivery
from khala_protocol.messages import Scene, Terrain
from khala_protocol.recording import Recording

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable
    from pathlib import Path

    from khala_bridge.state import Snapshot
    from khala_orchestrator.config import MatchConfig
    from tests.orchestrator.conftest import Hall, Peer

    MakeConfig = Callable[..., MatchConfig]
    MakeSnapshot = Callable[..., Snapshot]
    Drain = Callable[..., Awaitable[list[Any]]]

CLOCK = "jumps"


@dataclass
class Lookout:
    """A game that shows its whole map, or does not, and those who watch it."""

    answer: Snapshot | Exception | None = None
    asked: int = 0
    seen: list[Terrain | Scene] = field(default_factory=list)

    async def whole(self) -> Snapshot | None:
        self.asked += 1
        await asyncio.sleep(0)
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer

    async def terrain(self, terrain: Terrain) -> None:
        self.seen.append(terrain)

    async def scene(self, scene: Scene) -> None:
        self.seen.append(scene)


def scenery(config: MatchConfig, lookout: Lookout) -> Scenery:
    game: Any = lookout
    return Scenery(config.task, "test", game, lookout)


async def show(scenery: Scenery, *snapshots: Snapshot, episode: int = 0, step: int = 0) -> None:
    async with scenery.shown(StepId(episode, step), snapshots):
        await asyncio.sleep(1)


async def test_the_terrain_comes_once_an_episode_and_a_scene_each_step(
    config: MakeConfig, snapshot: MakeSnapshot
) -> None:
    lookout = Lookout(answer=snapshot())
    shows = scenery(config(), lookout)
    for episode, step in ((0, 0), (0, 1), (1, 0)):
        await show(shows, snapshot(loop=8 * step), episode=episode, step=step)
    assert [(one.kind, one.episode, getattr(one, "step", None)) for one in lookout.seen] == [
        ("terrain", 0, None), ("scene", 0, 0), ("scene", 0, 1), ("terrain", 1, None), ("scene", 1, 0),
    ]  # fmt: skip
    assert all(one.whole for one in lookout.seen if isinstance(one, Scene))


async def test_a_game_that_does_not_show_the_whole_map_shows_what_the_sides_see(
    config: MakeConfig, snapshot: MakeSnapshot
) -> None:
    lookout = Lookout()
    await show(scenery(config(), lookout), snapshot())
    (_, scene) = lookout.seen
    assert isinstance(scene, Scene)
    assert (scene.whole, len(scene.units), lookout.asked) == (False, 3, 1)


@pytest.mark.parametrize(("scenes", "shown"), [("seen", ["terrain", "scene"]), ("none", [])])
async def test_the_game_is_asked_only_if_somebody_wants_the_whole_map(
    scenes: str, shown: list[str], config: MakeConfig, snapshot: MakeSnapshot
) -> None:
    lookout = Lookout()
    await show(scenery(config(scenes=scenes), lookout), snapshot())
    assert ([one.kind for one in lookout.seen], lookout.asked) == (shown, 0)


async def test_a_game_that_dies_when_it_is_asked_ends_the_step(config: MakeConfig, snapshot: MakeSnapshot) -> None:
    shows = scenery(config(), Lookout(answer=GameError("the game died")))
    with pytest.raises(GameError, match="the game died"):
        await show(shows, snapshot())


async def test_a_step_that_is_broken_off_leaves_no_scene_behind(config: MakeConfig, snapshot: MakeSnapshot) -> None:
    lookout = Lookout(answer=snapshot())
    with pytest.raises(ZeroDivisionError):
        async with scenery(config(), lookout).shown(StepId(0, 0), [snapshot()]):
            raise ZeroDivisionError
    assert lookout.seen == []
    assert not [task for task in asyncio.all_tasks() if task.get_name() == "scene"]


async def test_a_recording_has_the_map_of_each_step_before_its_report(
    hall: Hall, config: MakeConfig, tmp_path: Path
) -> None:
    path = tmp_path / "r.mcap"
    await hall.play(config(record=path, max_steps=2))
    kinds = [sample.key.rpartition("/")[2] for sample in Recording.open(path) if sample.key.count("/") == 2]
    assert kinds == ["run", "terrain", "scene", "report", "scene", "report", "result"]


async def test_agents_are_sent_nothing_else_than_without_scenes(hall: Hall, config: MakeConfig, drain: Drain) -> None:
    sent: list[list[Any]] = []
    for scenes in ("none", "whole"):
        samples = await hall.broker.session().subscribe("khala/*/*/*/observation", Delivery.STATE)
        await hall.play(config(scenes=scenes), Stalkers=_attack)
        sent.append(await drain(samples))
    assert sent[0] == sent[1]


async def _attack(peer: Peer, seen: Any) -> None:
    await peer.answer(seen, "Actions:\nTeam Stalker-1:\n<Attack_Unit(0xb)>")


async def test_who_follows_the_file_finds_the_map_while_agents_think(
    hall: Hall, config: MakeConfig, tmp_path: Path
) -> None:
    path, found = tmp_path / "r.mcap", list[list[int]]()

    async def slow(peer: Peer, seen: Any) -> None:
        await asyncio.sleep(1)
        found.append([scene.step for scene in Recording.open(path).of(Scene)])
        await peer.answer(seen)

    await hall.play(config(record=path), Stalkers=slow)
    assert found == [[0], [0, 1], [0, 1, 2]]
