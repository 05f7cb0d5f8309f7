"""What each team's camera shows of all bodies, worked out for all teams of a moment at once.

A call of numpy takes longer than its work on a few dozen bodies, so there is one for all teams instead of one a team.
`khala_bridge.observe.scene`, above, makes views of the rows that are found here.
"""

from __future__ import annotations

from itertools import accumulate, chain, pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from khala_bridge.frames import CAMERA_WIDTH, sees

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import TypeAlias

    from numpy.typing import NDArray

    from khala_bridge.frames import Camera

    Bools: TypeAlias = NDArray[np.bool_]
    Floats: TypeAlias = NDArray[np.float64]
    Rows: TypeAlias = NDArray[np.intp]

_HALF = CAMERA_WIDTH / 2


class Shown(NamedTuple):
    """Some bodies for one camera."""

    rows: list[int]
    x: list[float]
    """Of the screen, to a tenth of a cell."""
    y: list[float]
    distance: list[float]
    """From the middle of the team, in world units."""


class Look(NamedTuple):
    """What one team looks at; who is not of the team is listed if the camera shows it."""

    camera: Camera
    members: Shown
    friends: Shown
    """By type and row."""
    foes: Shown
    """By type, distance and row."""


class BodyArrays(NamedTuple):
    """All bodies, one row each."""

    places: Floats
    """In the world: (n, 2)."""
    rank: Rows
    """Of the type, by name: (n,)."""
    friend: Bools
    """Who is listed as a friend: (n,)."""
    foe: Bools
    """Who is listed as a foe: (n,)."""


def looks(bodies: BodyArrays, cameras: Sequence[Camera], members: Sequence[Sequence[int]]) -> list[Look]:
    """Return what each team looks at.

    Args:
        bodies: all bodies.
        cameras: of each team, all of the same size.
        members: by team, the rows of its units; at least one.
    """
    places = bodies.places
    sizes = [len(rows) for rows in members]
    ends = [0, *accumulate(sizes)]
    mine = np.array(list(chain.from_iterable(members)))
    owner = np.repeat(np.arange(len(sizes)), sizes)
    centres = np.array([(camera.x, camera.y) for camera in cameras])
    others = sees(centres, places) & (bodies.friend | bodies.foe)
    others[owner, mine] = False
    team, row = (np.concatenate(parts) for parts in zip((owner, mine), others.nonzero(), strict=True))
    at = places[row]
    middles = np.add.reduceat(places[mine], ends[:-1], axis=0) / np.array(sizes)[:, None]
    apart = at - middles[team]
    distance = np.round(np.hypot(apart[:, 0], apart[:, 1]), 1)
    screen = _on_screen(at, centres[team], cameras[0].size)
    strangers = slice(len(mine), None)
    foe = bodies.foe[row[strangers]]
    group = 2 * team[strangers] + foe  # friends of a team, its foes, friends of the next
    order = np.lexsort((distance[strangers] * foe, bodies.rank[row[strangers]], group)) + len(mine)
    columns = [column[np.concatenate((np.arange(len(mine)), order))].tolist() for column in (row, *screen.T, distance)]
    bounds = [len(mine), *(len(mine) + np.cumsum(np.bincount(group, minlength=2 * len(sizes)))).tolist()]
    shown = [Shown(*[column[begin:end] for column in columns]) for begin, end in pairwise(ends + bounds[1:])]
    return [Look(camera, shown[place], *shown[len(sizes) + 2 * place :][:2]) for place, camera in enumerate(cameras)]


def _on_screen(at: Floats, centres: Floats, size: float) -> Floats:
    """Return world positions on the screens of cameras at these centres, in its cells: (k, 2), (k, 2) → (k, 2).

    They are rounded to a tenth of a cell, and stay within the frame, whose end is open.
    """
    cells = np.column_stack((at[:, 0] - centres[:, 0] + _HALF, centres[:, 1] + _HALF - at[:, 1]))
    cells *= size / CAMERA_WIDTH
    near = np.round(cells, 1) + 0.0  # no negative zero
    near[(cells < size) & (near >= size)] = round(size - 0.1, 1)
    return near
