"""Samples, pixel by pixel, and the bytes of images as PySC2 reads them."""

from typing import Any

import numpy as np
import pytest
from s2clientprotocol import common_pb2, spatial_pb2

from khala_simulator.api.raster import RasterLayer, Sampler


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
