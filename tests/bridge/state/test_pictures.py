from __future__ import annotations

from s2clientprotocol import common_pb2
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.state import GamePictures

SIZE = common_pb2.Size2DI(x=3, y=2)


def test_nothing_was_drawn() -> None:
    pictures = GamePictures(sc_pb.Observation())
    assert pictures.screen() is None
    assert pictures.minimap() is None
    assert pictures.layer("unit_type") is None
    assert pictures.layer("no such layer") is None
    assert pictures.minimap_layer("creep") is None
    assert pictures.layer_pixel("unit_type", 0, 0) is None


def test_a_rendered_image_becomes_blue_green_red() -> None:
    observation = sc_pb.Observation()
    image = common_pb2.ImageData(bits_per_pixel=24, size=SIZE, data=bytes(range(18)))
    observation.render_data.map.CopyFrom(image)
    screen = GamePictures(observation).screen()
    assert screen is not None
    assert screen.shape == (2, 3, 3)
    assert screen[0, 1].tolist() == [5, 4, 3]


def test_a_layer_begins_at_the_top_and_one_pixel_of_it_is_read_alone() -> None:
    observation = sc_pb.Observation()
    values = [1, 2, 3, 400, 500, 600]
    data = b"".join(value.to_bytes(4, "little") for value in values)
    for layers in (observation.feature_layer_data.renders, observation.feature_layer_data.minimap_renders):
        layers.unit_type.CopyFrom(common_pb2.ImageData(bits_per_pixel=32, size=SIZE, data=data))
    pictures = GamePictures(observation)
    for layer in (pictures.layer("unit_type"), pictures.minimap_layer("unit_type")):
        assert layer is not None
        assert layer.tolist() == [[1, 2, 3], [400, 500, 600]]
    assert pictures.layer_pixel("unit_type", 1, 1) == 500


def test_layers_of_one_bit_are_unpacked() -> None:
    observation = sc_pb.Observation()
    layers = observation.feature_layer_data.renders
    layers.creep.CopyFrom(common_pb2.ImageData(bits_per_pixel=1, size=SIZE, data=bytes([0b01010100])))
    layer = GamePictures(observation).layer("creep")
    assert layer is not None
    assert layer.tolist() == [[0, 1, 0], [1, 0, 1]]
