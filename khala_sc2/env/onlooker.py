"""Pictures of a match for those who watch: the whole map as the host publishes it, drawn from above.

Above: `khala_sc2.env.text`. Below: the bus, and `Terrain` and `Scene` of `khala_protocol.messages`.
"""

from __future__ import annotations

import asyncio
import base64
import zlib
from contextlib import suppress
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from khala_protocol.bus import Delivery
from khala_protocol.codec import decode_as
from khala_protocol.keys import Topic, run_key
from khala_protocol.messages import Scene, Terrain, UnitFlag

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from khala_protocol.bus import Sample, Subscription
    from khala_protocol.bus.memory import MemoryBroker, MemoryBus
    from khala_protocol.messages import UnitMark

    Picture = NDArray[np.uint8]
    Colour = tuple[int, int, int]

SIZE_PX: Final = 512
PATIENCE_S: Final = 10.0
"""For the scene of a step, which is put together while agents think."""
_COLOURS: Final[tuple[Colour, ...]] = ((90, 160, 255), (255, 90, 90), (250, 210, 80), (120, 220, 130))
_NOBODY: Final[Colour] = (150, 150, 150)
_LIFE: Final[Colour] = (110, 220, 110)


class Onlooker:
    """Listens to the map of a match, and draws it."""

    def __init__(self) -> None:
        self._terrain: Terrain | None = None
        self._scene: Scene | None = None
        self._changed = asyncio.Condition()
        self._bus: MemoryBus | None = None
        self._listening: list[asyncio.Task[None]] = []

    async def look(self, broker: MemoryBroker, run: str) -> None:
        """Listen from now on."""
        self._bus = broker.session()
        terrains = await self._bus.subscribe(run_key(run, Topic.TERRAIN), Delivery.STATE)
        scenes = await self._bus.subscribe(run_key(run, Topic.SCENE), Delivery.STATE)
        self._listening = [asyncio.create_task(self._hear(subscriber)) for subscriber in (terrains, scenes)]

    async def close(self) -> None:
        """Listen no more."""
        assert self._bus is not None
        await self._bus.close()
        await asyncio.gather(*self._listening, return_exceptions=True)

    async def picture(self, step: int) -> Picture:
        """Return the map at a step or later, [height, width, 3] RGB; the newest one if that does not come."""
        with suppress(TimeoutError):
            async with asyncio.timeout(PATIENCE_S), self._changed:
                await self._changed.wait_for(lambda: self._scene is not None and self._scene.step >= step)
        if self._terrain is None or self._scene is None:
            return np.zeros((SIZE_PX, SIZE_PX, 3), np.uint8)
        return draw(self._terrain, self._scene)

    async def _hear(self, samples: Subscription[Sample]) -> None:
        async for sample in samples:
            async with self._changed:
                if sample.key.endswith(Topic.TERRAIN):
                    self._terrain = decode_as(Terrain, sample.payload)
                else:
                    self._scene = decode_as(Scene, sample.payload)
                self._changed.notify_all()


def draw(terrain: Terrain, scene: Scene) -> Picture:
    """Return the playable part of a map with its units, [height, width, 3] RGB."""
    x0, y0, x1, y1 = terrain.bounds
    scale = SIZE_PX / max(x1 - x0, y1 - y0, 1.0)
    picture = _ground(terrain, scale)
    for unit in sorted(scene.units, key=lambda unit: bool(unit.flags & UnitFlag.FLYING)):
        _draw(picture, unit, (unit.x - x0) * scale, (unit.y - y0) * scale, max(unit.radius * scale, 2.0))
    return picture


def _ground(terrain: Terrain, scale: float) -> Picture:
    grid = terrain.height
    cells = np.frombuffer(zlib.decompress(base64.b64decode(grid.data)), np.uint8).reshape(grid.height, grid.width)
    walks = np.frombuffer(zlib.decompress(base64.b64decode(terrain.walkable.data)), np.uint8).reshape(cells.shape)
    grey = np.where(walks > 0, 40 + cells // 4, cells // 8).astype(np.uint8)
    x0, y0, x1, y1 = terrain.bounds
    per = max(terrain.size) / terrain.minimap  # cells of the grid, which are world units, per cell of the minimap
    part = grey[int(y0 * per) : int(np.ceil(y1 * per)), int(x0 * per) : int(np.ceil(x1 * per))]
    size = max(1, round((x1 - x0) * scale)), max(1, round((y1 - y0) * scale))
    whole = cv2.resize(part, size, interpolation=cv2.INTER_LINEAR)
    return np.repeat(whole[:, :, None], 3, axis=2)


def _draw(picture: Picture, unit: UnitMark, x: float, y: float, radius: float) -> None:
    colour = _COLOURS[(unit.player - 1) % len(_COLOURS)] if 0 < unit.player < 16 else _NOBODY
    at = round(x), round(y)
    cv2.circle(picture, at, round(radius), colour, thickness=-1, lineType=cv2.LINE_AA)
    ahead = round(x + radius * np.cos(unit.facing)), round(y + radius * np.sin(unit.facing))
    cv2.line(picture, at, ahead, (255, 255, 255), 1, cv2.LINE_AA)
    if unit.health_max:
        left = round(x - radius)
        over = round(y - radius) - 4
        cv2.line(picture, (left, over), (round(left + 2 * radius * unit.health / unit.health_max), over), _LIFE, 2)
