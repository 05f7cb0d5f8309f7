"""The minimap: the whole map in the frame that actions use, with units, teams and alerts on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from khala_bridge.frames import Camera
from khala_bridge.observe.image import minimap
from khala_bridge.observe.image.canvas import margin_of
from khala_bridge.observe.image.minimap import TeamMark
from khala_bridge.observe.image.moment import Moment
from khala_bridge.observe.image.palette import LIVERIES
from khala_protocol.messages import Frames

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray
    from s2clientprotocol import raw_pb2

    from khala_bridge.observe.image.palette import Colour
    from khala_bridge.state import Snapshot

    Snap = Callable[..., Snapshot]
    Unit = Callable[..., raw_pb2.Unit]

SIZE = 512


def draw(
    snapshot: Snapshot,
    teams: tuple[TeamMark, ...] = (),
    own: frozenset[int] = frozenset(),
    alerts: tuple[tuple[float, float], ...] = (),
) -> NDArray[np.uint8]:
    world = snapshot.info.frame(Frames())
    return minimap.draw(Moment(snapshot), world, teams, own, alerts, SIZE, grid=False)[0]


def middle_of(image: NDArray[np.uint8], colour: Colour) -> tuple[float, float]:
    """Return the column and row in the middle of the pixels of a colour."""
    rows, columns = np.nonzero((image == np.array(colour)).all(axis=2))
    return (columns.min() + columns.max()) / 2, (rows.min() + rows.max()) / 2


def pixel_of(x: float, y: float) -> tuple[float, float]:
    margin = margin_of(SIZE, 64)
    return margin + x * (SIZE - margin) / 64 - 0.5, margin + y * (SIZE - margin) / 64 - 0.5


@pytest.mark.parametrize("size", [(64, 64), (96, 48), (88, 176)])
@pytest.mark.parametrize(("name", "alliance"), [("Zealot", "enemy"), ("Nexus", "enemy"), ("Stalker", "own")])
@pytest.mark.parametrize(("x", "y"), [(12.0, 9.5), (40.5, 40.0)])
def test_a_unit_is_where_its_minimap_coordinate_says(
    snapshot: Snap, unit: Unit, size: tuple[int, int], name: str, alliance: str, x: float, y: float
) -> None:
    shown = snapshot([unit(1, name, x, y, alliance=alliance, radius=2.75 if name == "Nexus" else 0.6)], size=size)
    colour = LIVERIES["enemy" if alliance == "enemy" else "own"].body
    point = shown.info.frame(Frames()).minimap(x, y)
    assert middle_of(draw(shown), colour) == pytest.approx(pixel_of(*point), abs=1)


def test_ones_own_teams_are_told_from_the_rest_of_the_side(snapshot: Snap, unit: Unit) -> None:
    shown = snapshot([unit(1, "Stalker", 8, 8), unit(2, "Stalker", 24, 24)])
    image = draw(shown, own=frozenset([1]))
    assert middle_of(image, LIVERIES["team"].body) == pytest.approx(pixel_of(16, 48), abs=1)
    assert middle_of(image, LIVERIES["own"].body) == pytest.approx(pixel_of(48, 16), abs=1)


def test_a_frame_shows_what_a_team_sees(snapshot: Snap) -> None:
    shown = snapshot([], size=(64, 64))
    image = draw(shown, teams=(TeamMark("A", Camera(32, 32)),))
    changed = (image == 255).all(axis=2)
    columns, rows = np.flatnonzero(changed.sum(axis=0) > 100), np.flatnonzero(changed.sum(axis=1) > 100)
    left, top = pixel_of(20, 20)
    right, bottom = pixel_of(44, 44)
    assert (columns.min(), columns.max()) == pytest.approx((left, right), abs=1)
    assert (rows.min(), rows.max()) == pytest.approx((top, bottom), abs=1)


def test_alerts_are_ringed(snapshot: Snap) -> None:
    image = draw(snapshot([], size=(64, 64)), alerts=((40.0, 20.0),))
    rows, columns = np.nonzero((np.abs(image.astype(int) - minimap.ALERT) < 40).all(axis=2))
    assert ((columns.min() + columns.max()) / 2, (rows.min() + rows.max()) / 2) == pytest.approx(
        pixel_of(40, 20), abs=1
    )


def test_teams_beyond_six_get_no_frame_but_all_get_a_name(snapshot: Snap) -> None:
    shown = snapshot([], size=(64, 64))
    few, many = (tuple(TeamMark(f"T{k}", Camera(4 + 6 * k, 10 + 4 * k)) for k in range(n)) for n in (6, 10))
    lines = [int(((draw(shown, teams=teams) == 255).all(axis=2).sum(axis=0) > 60).sum()) for teams in (few, many)]
    assert lines[0] == lines[1]


def test_a_commander_sees_where_the_teams_of_others_are(snapshot: Snap) -> None:
    shown = snapshot([], size=(64, 64))
    world = shown.info.frame(Frames())
    bare, named = (
        minimap.draw(Moment(shown), world, (), frozenset(), (), SIZE, others=others)[0]
        for others in ((), (("Zealot-1", (40.0, 12.0)),))
    )
    column, row = (round(value) for value in pixel_of(40, 12))
    assert tuple(named[row, column].tolist()) == LIVERIES["own"].mark
    changed = np.nonzero((named != bare).any(axis=2))[1]
    assert changed.min() < column
    assert changed.max() > column + 30  # its name stands beside it


def test_a_wide_map_leaves_the_rest_of_the_frame_void(snapshot: Snap) -> None:
    image = draw(snapshot([], size=(64, 32)))
    column, row = (round(value) for value in pixel_of(32, 48))
    assert tuple(image[row, column].tolist()) == (14, 12, 11)
