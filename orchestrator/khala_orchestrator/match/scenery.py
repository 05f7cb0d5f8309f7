"""Terrain and scenes of a match: what those who watch are told of the map, and never agents.

The scene of a step is made while its agents think, so that it costs the match next to nothing: the game, which stands
still meanwhile, is asked for the whole map in its own thread and process. Above: `khala_orchestrator.match.match`.
Below: `khala_bridge.overview`, which puts a scene together.
"""

from __future__ import annotations

import asyncio
import contextlib
from typing import TYPE_CHECKING, Protocol

from khala_bridge.overview import Watched, scene_of, terrain_of

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Sequence

    from khala_bridge.game.game import Sides
    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import TaskConfig
    from khala_orchestrator.match.schedule import StepId
    from khala_protocol.messages import Scene, Terrain


class Onlookers(Protocol):
    """Those who watch a match."""

    async def terrain(self, terrain: Terrain) -> None:
        """Take the ground of an episode, before its first scene."""
        ...

    async def scene(self, scene: Scene) -> None:
        """Take the map at a step, before the report of the step."""
        ...


class Scenery:
    """Shows the map of a match to its onlookers."""

    def __init__(self, task: TaskConfig, run: str, game: Sides, onlookers: Onlookers) -> None:
        """Take a match's task, its name and game, and those who watch; `task.scenes` says what they see."""
        self._task = task
        self._run = run
        self._game = game
        self._onlookers = onlookers
        self._names = [side.side for side in task.per_side()]
        self._before: Sequence[Snapshot] | None = None
        self._terrain: Terrain | None = None

    @contextlib.asynccontextmanager
    async def shown(self, at: StepId, snapshots: Sequence[Snapshot]) -> AsyncIterator[None]:
        """Show the map of a step while the block runs; the game must stand still in it.

        Raises:
            GameError: the game died, or hangs.
        """
        if self._task.scenes == "none":
            yield
            return
        showing = asyncio.create_task(self._show(at, snapshots), name="scene")
        try:
            yield
        except BaseException:
            showing.cancel()
            await asyncio.wait([showing])
            raise
        await showing

    async def _show(self, at: StepId, snapshots: Sequence[Snapshot]) -> None:
        frames = self._task.frames
        whole = await self._whole()
        if self._terrain is None or self._terrain.episode != at.episode:
            self._terrain = terrain_of(snapshots, whole, frames, run=self._run, episode=at.episode)
            self._before = None
            await self._onlookers.terrain(self._terrain)
        before: Sequence[Snapshot | None] = self._before or [None] * len(snapshots)
        sides = [Watched(*side) for side in zip(self._names, snapshots, before, strict=True)]
        self._before = snapshots
        await self._onlookers.scene(scene_of(sides, whole, self._terrain, frames, step=at.step))

    async def _whole(self) -> Snapshot | None:
        """Return the whole map, unless nobody wants it; two sides know all units together."""
        return await self._game.whole() if self._task.scenes == "whole" and len(self._names) == 1 else None
