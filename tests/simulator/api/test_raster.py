"""Discs and samples, pixel by pixel, and their bytes as PySC2 reads them."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from s2clientprotocol import common_pb2, spatial_pb2

from khala_simulator.api.raster import Discs, RasterLayer, Sampler, draw_discs


def discs(*circles: tuple[float, float, float], size: int = 8) -> Discs:
    table = np.array(circles, float).reshape(-1, 3)
    return draw_discs(table[:, :2], table[:, 2], size, size)


def picture(drawn: Discs, values: list[int], size: int = 8) -> list[str]:
    image = np.zeros(size * size, int)
    image[drawn.pixels] = np.array(values)[drawn.rows]
    return ["".join(".123456789"[v] for v in line) for line in image.reshape(size, size)]


def test_a_disc_covers_the_pixels_whose_centres_are_in_it() -> None:
    assert picture(discs((4.0, 3.0, 2.0)), [1]) == [
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
    drawn = discs((2.9, 5.1, 0.01))
    assert drawn.pixels.tolist() == [5 * 8 + 2]


@pytest.mark.parametrize("sizes", [(1.4, 1.4), (1.4, 3.4), (3.4, 1.4)])
def test_of_two_discs_the_later_one_is_on_top(sizes: tuple[float, float]) -> None:
    drawn = discs((4.0, 4.0, sizes[0]), (4.0, 4.0, sizes[1]))
    assert picture(drawn, [1, 2])[4][4] == "2"


def test_density_counts_discs_and_saturates() -> None:
    drawn = discs(*[(4.0, 4.0, 1.0)] * 300)
    assert drawn.density.reshape(8, 8)[4, 4] == 255
    assert drawn.density.reshape(8, 8)[0, 0] == 0
    two = discs((4.0, 4.0, 2.0), (4.5, 4.5, 2.0))
    assert two.density.reshape(8, 8)[4, 4] == 2
    assert two.smooth.reshape(8, 8)[4, 4] == 32


def test_smooth_density_fades_at_the_edge() -> None:
    smooth = discs((4.0, 4.0, 2.0)).smooth.reshape(8, 8)
    assert smooth[4, 4] == 16
    assert 0 < smooth[3, 5] < 16
    assert smooth[4, 6] == 0


@given(
    st.lists(
        st.tuples(st.floats(-40, 40), st.floats(-40, 40), st.floats(0, 30)),
        max_size=12,
    )
)
def test_no_disc_leaves_the_image(circles: list[tuple[float, float, float]]) -> None:
    drawn = discs(*circles)
    assert ((drawn.pixels >= 0) & (drawn.pixels < 64)).all()
    assert (np.diff(drawn.rows) >= 0).all()
    assert drawn.density.sum() == len(drawn.pixels) or drawn.density.max(initial=0) == 255


def test_samples_outside_of_the_map_are_zero() -> None:
    grid = np.array([[1, 2], [3, 4]], np.uint8)
    image = Sampler((2, 2), np.array([-0.5, 0.5, 1.5, 2.5]), np.array([1.5, 0.5, -0.5])).take(grid)
    assert image.tolist() == [[0, 3, 4, 0], [0, 1, 2, 0], [0, 0, 0, 0]]


def decode(parts: list[bytes | memoryview], name: str) -> common_pb2.ImageData:
    image = getattr(spatial_pb2.FeatureLayers.FromString(b"".join(parts)), name)
    assert isinstance(image, common_pb2.ImageData)
    return image


@pytest.mark.parametrize(
    ("bits", "image", "data"),
    [
        (1, [[1, 0, 0], [0, 0, 0], [0, 0, 1]], b"\x80\x80"),
        (8, [[1, 0, 0], [0, 0, 0], [0, 0, 9]], bytes([1, 0, 0, 0, 0, 0, 0, 0, 9])),
        (32, [[1, 0, 0], [0, 0, 0], [0, 0, 515]], b"\1\0\0\0" + bytes(28) + b"\3\2\0\0"),
        (
            24,
            [[[1, 2, 3], [0] * 3, [0] * 3], [[0] * 3] * 3, [[0] * 3, [0] * 3, [7, 8, 9]]],
            b"\1\2\3" + bytes(21) + b"\7\10\11",
        ),
    ],
)
def test_layers_are_rows_from_the_top_most_significant_bit_first(bits: int, image: list[Any], data: bytes) -> None:
    layer = RasterLayer(1, bits, 3, 3)
    message = decode(layer.encode(np.array(image)), "height_map")
    assert (message.bits_per_pixel, message.size.x, message.size.y) == (bits, 3, 3)
    assert message.data == data
    assert decode(layer.blank, "height_map").data == bytes(len(data))


def test_pixels_have_their_values_and_the_later_one_counts() -> None:
    layer = RasterLayer(6, 32, 8, 8)
    data = decode(layer.encode_pixels(np.array([9, 14, 9]), np.array([74, 73, 105], np.int32)), "unit_type").data
    image = np.frombuffer(data, np.int32).reshape(8, 8)
    assert image[1, 1] == 105
    assert image[1, 6] == 73
    assert image.sum() == 178


def test_many_discs_are_drawn_as_few_are() -> None:
    circles = [(i % 29 + 0.3, i % 31 + 0.7, 0.4 + i % 5) for i in range(200)]
    together = discs(*circles, size=32)
    one_by_one = [discs(circle, size=32) for circle in circles]
    assert together.pixels.tolist() == [pixel for one in one_by_one for pixel in one.pixels]
    assert together.rows.tolist() == [row for row, one in enumerate(one_by_one) for _ in one.pixels]
