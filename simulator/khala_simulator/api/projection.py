"""World coordinates to pixels of the screen and of the minimap, and back.

World: origin bottom-left, y up. Images: origin top-left, y down, pixel (i, j) covers [i, i+1) x [j, j+1). Pixels are
square in the world. Pure arithmetic; works on numbers and on arrays.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, NamedTuple, TypeVar

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from s2clientprotocol import sc2api_pb2 as sc

Number = TypeVar("Number", float, "NDArray[np.float64]")

MAX_PIXELS = 4096
MAX_WIDTH, MAX_SCALE = 1000.0, 256.0
"""World units that a screen may show, and pixels that one of them may have."""
DEFAULT_WIDTH = 24.0
"""World units that the screen shows along its shorter side when a client does not say."""


class Rect(NamedTuple):
    """A rectangle of the world: [x0, x1) x [y0, y1)."""

    x0: float
    y0: float
    x1: float
    y1: float

    def clamp(self, x: float, y: float) -> tuple[float, float]:
        """Return the point of the rectangle that is nearest to (x, y)."""
        return min(max(x, self.x0), self.x1), min(max(y, self.y0), self.y1)


@dataclasses.dataclass(frozen=True)
class ScreenView:
    """The camera's view: `width` world units along the shorter side of the image, whatever its shape."""

    columns: int
    rows: int
    width: float

    @property
    def scale(self) -> float:
        """World units per pixel."""
        return self.width / min(self.columns, self.rows)

    def to_pixels(self, x: Number, y: Number, camera: tuple[float, float]) -> tuple[Number, Number]:
        """Return the image coordinates of world points; they continue outside of the image."""
        return (
            (x - camera[0]) / self.scale + self.columns / 2,
            (camera[1] - y) / self.scale + self.rows / 2,
        )

    def to_world(self, column: Number, row: Number, camera: tuple[float, float]) -> tuple[Number, Number]:
        """Return the world coordinates of the centres of pixels."""
        return (
            (column + 0.5 - self.columns / 2) * self.scale + camera[0],
            camera[1] - (row + 0.5 - self.rows / 2) * self.scale,
        )

    def view(self, camera: tuple[float, float]) -> Rect:
        """Return the part of the world that the camera shows."""
        half_x, half_y = self.columns * self.scale / 2, self.rows * self.scale / 2
        return Rect(camera[0] - half_x, camera[1] - half_y, camera[0] + half_x, camera[1] + half_y)


@dataclasses.dataclass(frozen=True)
class Minimap:
    """The part of the map that the minimap shows, fitted into the image at its top-left corner."""

    columns: int
    rows: int
    area: Rect

    @property
    def scale(self) -> float:
        """World units per pixel."""
        return max((self.area.x1 - self.area.x0) / self.columns, (self.area.y1 - self.area.y0) / self.rows)

    def to_pixels(self, x: Number, y: Number) -> tuple[Number, Number]:
        """Return the image coordinates of world points."""
        return (x - self.area.x0) / self.scale, (self.area.y1 - y) / self.scale

    def to_world(self, column: Number, row: Number) -> tuple[Number, Number]:
        """Return the world coordinates of the centres of pixels."""
        return self.area.x0 + (column + 0.5) * self.scale, self.area.y1 - (row + 0.5) * self.scale


@dataclasses.dataclass(frozen=True)
class ImagePair:
    """The two images of one kind that a client looks at and clicks on."""

    screen: ScreenView
    minimap: Minimap


def view_of(setup: sc.SpatialCameraSetup, area: Rect, width: float = DEFAULT_WIDTH) -> ImagePair:
    """Return the images that a client asked for, the minimap of this part of the map; `width` is the default width."""
    screen, minimap = setup.resolution, setup.minimap_resolution
    return ImagePair(ScreenView(screen.x, screen.y, setup.width or width), Minimap(minimap.x, minimap.y, area))


def size_problem(options: sc.InterfaceOptions) -> str | None:
    """Return the error in the sizes of the images that a client asks for, if there is one."""
    asked = (
        ("Feature layers", options.HasField("feature_layer"), options.feature_layer),
        ("Rendered images", options.HasField("render"), options.render),
    )
    for name, wanted, setup in asked:
        for size in (setup.resolution, setup.minimap_resolution) if wanted else ():
            if not (0 < size.x <= MAX_PIXELS and 0 < size.y <= MAX_PIXELS):
                return f"{name} of {size.x} x {size.y} pixels; between 1 and {MAX_PIXELS} are possible"
        shorter = min(setup.resolution.x, setup.resolution.y)
        width = setup.width or DEFAULT_WIDTH
        if wanted and not shorter / MAX_SCALE <= width <= MAX_WIDTH:
            least = shorter / MAX_SCALE
            return f"{name} of {width:g} world units; between {least:g} and {MAX_WIDTH:g} are possible in this size"
    return None
