"""Discs, pixel by pixel, in layers of every depth, one frame after the other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from s2clientprotocol import spatial_pb2

from khala_simulator.api.discs import DiscLayers
from khala_simulator.api.raster import RasterLayer

if TYPE_CHECKING:
    from numpy.typing import NDArray

Circle = tuple[float, float, float]
COLUMNS, ROWS = 21, 13
LAYERS = {"creep": 1, "player_id": 8, "unit_type": 32}
FIELDS = spatial_pb2.FeatureLayers.DESCRIPTOR.fields_by_name

centres = st.one_of(st.floats(-15, 40), st.integers(-60, 160).map(lambda quarter: quarter / 4))
circles = st.tuples(centres, centres, st.floats(0, 12), st.integers(-(1 << 31), (1 << 31) - 1) | st.integers(0, 3))
frames = st.lists(st.lists(circles, max_size=9), min_size=1, max_size=4)


def disc_layers(columns: int, rows: int, *, dense: bool = True) -> DiscLayers:
    """Return a layer of each depth, in which discs have the values of a row each, and the density of the discs."""

    def layer(name: str, bits: int) -> RasterLayer:
        return RasterLayer(FIELDS[name].number, bits, columns, rows)

    shown = [(row, layer(name, bits)) for row, (name, bits) in enumerate(LAYERS.items())]
    return DiscLayers(shown, (layer("unit_density", 8), layer("unit_density_aa", 8)) if dense else None, columns, rows)


def encode(layers: DiscLayers, table: list[Circle], values: list[int]) -> spatial_pb2.FeatureLayers:
    """Return the layers of discs with one value each, which all layers show."""
    x, y, radius = (np.ascontiguousarray(column) for column in np.array(table, np.float64).reshape(-1, 3).T)
    message = b"".join(layers.encode(x, y, radius, np.array([values] * len(LAYERS), np.int32)))
    return spatial_pb2.FeatureLayers.FromString(message)


def picture(*discs: Circle, size: int = 8) -> list[str]:
    """Return an image in which the discs are 1, 2 and so on."""
    shown = encode(disc_layers(size, size), list(discs), list(range(1, len(discs) + 1))).player_id.data
    return ["".join(".123456789"[value] for value in shown[at : at + size]) for at in range(0, size * size, size)]


def densities(*discs: Circle, size: int = 8) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return how many discs there are at each pixel, and 16 x what they cover of it."""
    shown = encode(disc_layers(size, size), list(discs), [1] * len(discs))
    many, smooth = (np.frombuffer(image.data, np.uint8) for image in (shown.unit_density, shown.unit_density_aa))
    return many.reshape(size, size), smooth.reshape(size, size)


def test_a_disc_covers_the_pixels_whose_centres_are_in_it() -> None:
    assert picture((4.0, 3.0, 2.0)) == [
        "........",
        "...11...",
        "..1111..",
        "..1111..",
        "...11...",
        "........",
        "........",
        "........",
    ]


def test_the_smallest_disc_is_one_pixel() -> None:
    assert picture((2.9, 5.1, 0.01)) == ["........"] * 5 + ["..1....."] + ["........"] * 2


@pytest.mark.parametrize("sizes", [(1.4, 1.4), (1.4, 3.4), (3.4, 1.4)])
def test_of_two_discs_the_later_one_is_on_top(sizes: tuple[float, float]) -> None:
    assert picture((4.0, 4.0, sizes[0]), (4.0, 4.0, sizes[1]))[4][4] == "2"


def test_density_counts_discs_and_saturates() -> None:
    many, _ = densities(*[(4.0, 4.0, 1.0)] * 300)
    assert many[4, 4] == 255
    assert many[0, 0] == 0
    many, smooth = densities((4.0, 4.0, 2.0), (4.5, 4.5, 2.0))
    assert many[4, 4] == 2
    assert smooth[4, 4] == 32


def test_smooth_density_fades_at_the_edge() -> None:
    _, smooth = densities((4.0, 4.0, 2.0))
    assert smooth[4, 4] == 16
    assert 0 < smooth[3, 5] < 16
    assert smooth[4, 6] == 0


def drawn(
    frame: list[tuple[float, float, float, int]],
) -> tuple[NDArray[np.int32], NDArray[np.int64], NDArray[np.float64]]:
    """Return the topmost value at each pixel, how many discs are there, and 16 x what they cover of it."""
    row, column = np.mgrid[:ROWS, :COLUMNS]
    top = np.zeros((ROWS, COLUMNS), np.int32)
    many, covered = np.zeros((ROWS, COLUMNS), np.int64), np.zeros((ROWS, COLUMNS))
    for x, y, radius, value in frame:
        distance = np.sqrt((column + 0.5 - x) ** 2 + (row + 0.5 - y) ** 2)
        inside = (distance <= radius) | ((column == np.floor(x)) & (row == np.floor(y)))
        top[inside] = value
        many += inside
        covered += np.clip(radius - distance + 0.5, 0.0, 1.0) * 16
    return top, many, covered


@given(frames, st.booleans())
def test_any_discs_are_drawn_as_pixel_by_pixel_after_any_others(
    frames: list[list[tuple[float, float, float, int]]], dense: bool
) -> None:
    layers = disc_layers(COLUMNS, ROWS, dense=dense)
    for frame in frames:
        shown = encode(layers, [(x, y, radius) for x, y, radius, _ in frame], [value for *_, value in frame])
        top, many, covered = drawn(frame)
        assert shown.creep.data == np.packbits(top != 0).tobytes()
        assert shown.player_id.data == (top & 0xFF).astype(np.uint8).tobytes()
        assert shown.unit_type.data == top.astype("<i4").tobytes()
        assert shown.HasField("unit_density") is dense
        if dense:
            assert shown.unit_density.data == np.minimum(many, 255).astype(np.uint8).tobytes()
            assert shown.unit_density_aa.data == np.minimum(covered, 255).astype(np.uint8).tobytes()


def test_what_is_no_array_of_discs_is_refused() -> None:
    layers = disc_layers(COLUMNS, ROWS)
    none = np.zeros(2)
    with pytest.raises(ValueError, match="int32"):
        layers.encode(none, none, none, np.zeros((3, 2)))  # type: ignore[arg-type]  # that is what is wrong with it
    with pytest.raises(ValueError, match="float64, one for each value"):
        layers.encode(none, none[:1], none, np.zeros((3, 2), np.int32))
