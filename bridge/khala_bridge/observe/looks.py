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
    from collections.abc import Iterator, Sequence
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


class Bodies(NamedTuple):
    """All bodies, one row each."""

    places: Floats
    """In the world: (n, 2)."""
    rank: Rows
    """Of the type, by name: (n,)."""
    friend: Bools
    foe: Bools


def looks(bodies: Bodies, cameras: Sequence[Camera], members: Sequence[Sequence[int]]) -> list[Look]:
    """Return what each team looks at.

    Args:
        bodies: all bodies.
        cameras: of each team, all of the same size.
        members: by team, the rows of its units; at least one.
    """
    places, rows = bodies.places, np.array(list(chain.from_iterable(members)), dtype=int)
    ends = list(accumulate(map(len, members)))
    teams = np.repeat(np.arange(len(members)), [len(one) for one in members])
    centres = np.array([(camera.x, camera.y) for camera in cameras])
    others = sees(centres, places)
    others[teams, rows] = False
    sums = np.add.reduceat(places[rows], [0, *ends[:-1]], axis=0)
    middles = sums / np.array([[len(one)] for one in members])
    apart = places - middles[:, None]
    distance = np.round(np.hypot(apart[..., 0], apart[..., 1]), 1)
    at_x, at_y = _on_screens(centres, cameras[0].size, places)

    def shown(team: Rows, row: Rows) -> Iterator[Shown]:
        bounds = [0, *np.cumsum(np.bincount(team, minlength=len(members))).tolist()]
        columns = [one.tolist() for one in (row, at_x[team, row], at_y[team, row], distance[team, row])]
        return (Shown(*[column[begin:end] for column in columns]) for begin, end in pairwise(bounds))

    def ordered(mask: Bools, *, by_distance: bool) -> tuple[Rows, Rows]:
        team, row = np.nonzero(mask)
        keys = (distance[team, row],) if by_distance else ()
        order = np.lexsort((*keys, bodies.rank[row], team))
        return team[order], row[order]

    found = zip(
        cameras,
        shown(teams, rows),
        shown(*ordered(others & bodies.friend, by_distance=False)),
        shown(*ordered(others & bodies.foe, by_distance=True)),
        strict=True,
    )
    return [Look(*one) for one in found]


def _on_screens(centres: Floats, size: float, places: Floats) -> tuple[Floats, Floats]:
    """Return where bodies are on screens of this size, x and y, each (teams, n)."""
    scale = size / CAMERA_WIDTH
    right = places[:, 0] - centres[:, :1] + _HALF
    down = centres[:, 1:] + _HALF - places[:, 1]
    return _tenths(right * scale, size), _tenths(down * scale, size)


def _tenths(values: Floats, size: float) -> Floats:
    """Return positions rounded to a tenth of a cell; they stay within the frame, whose end is open."""
    near = np.round(values, 1) + 0.0  # no negative zero
    near[(values < size) & (near >= size)] = round(size - 0.1, 1)
    return near
