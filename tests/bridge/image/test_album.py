"""The pictures of an observation: which there are, in which form, with which words."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from khala_bridge.observe import Observer
from khala_bridge.observe.image import titles
from khala_bridge.observe.image.encoding import encode
from khala_bridge.observe.image.screen import Legend
from khala_bridge.task.images import ImageSpec
from khala_orchestrator.config import load_task

if TYPE_CHECKING:
    from collections.abc import Callable

    from s2clientprotocol import raw_pb2
    from s2clientprotocol import sc2api_pb2 as sc_pb

    from khala_bridge.observe.picture import Picture
    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import TaskConfig

    Snap = Callable[..., Snapshot]
    Show = Callable[..., tuple[Picture, ...]]


@pytest.fixture
def show(task: Callable[..., TaskConfig], snapshot: Snap, battle: list[raw_pb2.Unit]) -> Show:
    """Return the pictures of the agent of 2s3z, with its three teams, for these specifications."""

    def see(*specs: dict[str, Any], shown: Snapshot | None = None, name: str = "2s3z") -> tuple[Picture, ...]:
        config = task(name)
        agent = config.agents[0].model_copy(update={"images": tuple(ImageSpec(**spec) for spec in specs)})
        config = config.model_copy(update={"agents": (agent,)})
        observation = Observer(config).observe(shown if shown is not None else snapshot(battle))
        return observation.agents[agent.name].pictures

    return see


def test_without_a_specification_there_is_no_picture(show: Show) -> None:
    assert show() == ()


def test_pictures_come_in_the_order_of_the_configuration_one_for_each_team(show: Show) -> None:
    pictures = show({"what": "minimap"}, {"what": "screen"}, {"what": "layer:creep", "max_teams": 1})
    assert [p.name for p in pictures] == [
        "minimap", "screen-Zealot-1", "screen-Zealot-2", "screen-Stalker-1", "creep-Zealot-1"
    ]  # fmt: skip


def test_no_more_teams_are_shown_than_are_asked_for(show: Show) -> None:
    assert len(show({"what": "screen", "max_teams": 2})) == 2


@pytest.mark.parametrize(
    ("what", "picture"),
    [
        ("screen", "screen-Zealot-1"),
        ("minimap", "minimap"),
        ("features", "features-Zealot-1"),
        ("layer:height_map", "height_map-Zealot-1"),
        ("layer:unit_type", "unit_type-Zealot-1"),
    ],
)
@pytest.mark.parametrize(
    ("form", "magic"), [("jpeg", b"\xff\xd8\xff"), ("png", b"\x89PNG\r\n\x1a\n"), ("webp", b"RIFF")]
)
@pytest.mark.parametrize("size_px", [256, 512])
def test_pictures_decode_in_the_form_and_size_that_was_asked_for(
    show: Show, what: str, picture: str, form: str, magic: bytes, size_px: int
) -> None:
    (first, *_) = show({"what": what, "format": form, "size_px": size_px})
    assert first.name == picture
    assert first.media_type == f"image/{form}"
    assert first.data.startswith(magic)
    decoded = cv2.imdecode(np.frombuffer(first.data, np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    assert decoded.shape == (first.height, first.width, 3) == (size_px, size_px, 3)
    assert first.sha256 == hashlib.sha256(first.data).hexdigest()
    ref = first.ref
    assert (ref.sha256, ref.bytes, ref.width, ref.title) == (first.sha256, len(first.data), size_px, first.title)


def test_png_keeps_every_pixel() -> None:
    image = np.random.default_rng(1).integers(0, 255, (64, 64, 3), np.uint8)
    decoded = cv2.imdecode(np.frombuffer(encode(image, "n", "t", "png").data, np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    assert np.array_equal(decoded, image)


def test_the_same_step_gives_the_same_bytes(show: Show) -> None:
    specs = ({"what": "screen"}, {"what": "minimap"}, {"what": "features"})
    assert [p.sha256 for p in show(*specs)] == [p.sha256 for p in show(*specs)]


def test_quality_makes_files_smaller(show: Show) -> None:
    small, large = (show({"what": "screen", "quality": quality, "max_teams": 1})[0] for quality in (30, 95))
    assert len(small.data) < 0.6 * len(large.data)


def test_without_marks_there_are_neither_letters_nor_digits(show: Show) -> None:
    plain, marked = (show({"what": "screen", "marks": marks, "max_teams": 1})[0] for marks in (False, True))
    assert "letters" in marked.title
    assert "a mark at a unit" in marked.title
    assert "letters" not in plain.title
    assert "mark" not in plain.title


def render(response: sc_pb.ResponseObservation, _: sc_pb.ResponseGameInfo) -> None:
    """Give a snapshot pictures of the game's own, all of one colour."""
    for image in (response.observation.render_data.map, response.observation.render_data.minimap):
        image.size.x = image.size.y = 64
        image.bits_per_pixel = 24
        image.data = bytes([10, 200, 30]) * 64 * 64


def greenness(picture: Picture) -> float:
    decoded = cv2.imdecode(np.frombuffer(picture.data, np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    return float((decoded.astype(int)[..., 1] > 150).mean())


@pytest.mark.parametrize(
    ("source", "camera", "count", "is_green"),
    [
        ("game", (14, 16), 1, True),
        ("game", (25, 16), 0, False),  # the camera is elsewhere
        ("auto", (14, 16), 1, True),
        ("auto", (25, 16), 1, False),
        ("drawn", (14, 16), 1, False),
        (None, (14, 16), 1, False),
    ],
)
def test_the_games_own_pixels_are_taken_where_they_are_wanted_and_there(
    show: Show,
    snapshot: Snap,
    battle: list[raw_pb2.Unit],
    source: str | None,
    camera: tuple[float, float],
    count: int,
    is_green: bool,
) -> None:
    shown = snapshot(battle, camera=camera, change=render)
    pictures = show({"what": "screen", "source": source, "max_teams": 1}, shown=shown)
    assert len(pictures) == count
    assert [greenness(picture) > 0.5 for picture in pictures] == [is_green] * count
    assert [("rendered by the game" in picture.title) for picture in pictures] == [is_green] * count


def test_without_the_games_pixels_what_only_it_draws_is_left_out(show: Show) -> None:
    assert (
        show({"what": "screen", "source": "game"}, {"what": "minimap", "source": "game"}, {"what": "layer:cloaked"})
        == ()
    )
    assert show({"what": "minimap:alerts"}) == ()


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (
            {"what": "photo"},
            "there is no picture 'photo', there are screen, minimap, features, layer:<name>, minimap:<name>",
        ),
        ({"what": "sreen"}, "there is no picture 'sreen', did you mean 'screen'?"),
        ({"what": "layer:hight_map"}, "there is no picture 'layer:hight_map', did you mean 'layer:height_map'?"),
        ({"what": "minimap:power"}, "there is no picture 'minimap:power'"),
        ({"what": "screen", "size_px": 5000}, "less than or equal to 2048"),
        ({"what": "screen", "format": "gif"}, "'jpeg', 'png' or 'webp'"),
        (
            {"what": "layer:cloaked", "source": "drawn"},
            "layer:cloaked comes from the game only: leave source out, or say",
        ),
        ({"what": "minimap:alerts", "source": "drawn"}, "minimap:alerts comes from the game only"),
    ],
)
def test_what_is_wrong_with_a_specification_is_said(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(ValidationError) as raised:
        ImageSpec(**wrong)
    assert words in raised.value.errors()[0]["msg"]


def test_who_orders_the_whole_side_sees_all_of_it_as_its_own(snapshot: Snap, battle: list[raw_pb2.Unit]) -> None:
    def title(name: str) -> str:
        config = load_task(name)
        agent = config.agents[0].model_copy(update={"images": (ImageSpec(what="minimap"),)})
        observation = Observer(config.model_copy(update={"agents": (agent,)})).observe(snapshot(battle))
        return observation.agents[agent.name].pictures[0].title

    assert "blue: your units, red: enemies;" in title("simple64_eceb")  # a Commander with a team of the kind side
    assert "green: your side's other units" in title("pvz_task6_level1")  # an agent that only talks


def test_the_game_renders_only_for_those_who_ask_for_it(task: Callable[..., TaskConfig]) -> None:
    def rendered(*specs: ImageSpec) -> int | None:
        config = task("2s3z")
        return config.model_copy(update={"agents": (config.agents[0].model_copy(update={"images": specs}),)}).render_px

    assert rendered(ImageSpec(what="screen"), ImageSpec(what="layer:creep", source="game")) is None
    assert rendered(ImageSpec(what="screen", source="auto")) == 512
    assert (
        rendered(ImageSpec(what="screen", source="game", size_px=300), ImageSpec(what="minimap", source="game")) == 512
    )


# --- words --------------------------------------------------------------------------------------------------


TITLES = [
    (
        titles.of_screen(
            "Stalker-1",
            24,
            Legend(("team", "enemy", "neutral"), {"ST": "Stalker", "ZE": "Zealot"}, ("014", 0x100140001), 2),
        ),
        [
            "Screen of team Stalker-1, from [0, 0] at the top left to [24, 24]",
            "blue: this team, red: enemies",
            "letters: ST Stalker, ZE Zealot",
            "a mark at a unit is the part of its tag before the last four digits, 014 is 0x100140001",
            "2 units have no mark for want of room.",
        ],
    ),
    (
        titles.of_screen("A", 24, Legend(("enemy",), rendered=True)),
        [
            "Screen of team A, from [0, 0] at the top left to [24, 24]",
            "rendered by the game",
            "marks: red: enemies.",
        ],
    ),
    (
        titles.of_minimap(64, Legend(("team", "own", "ally", "enemy"))),
        [
            "Minimap, from [0, 0] at the top left to [64, 64]",
            "blue: your units, green: your side's other units, yellow: allied players, red: enemies",
            "squares are structures and resources",
            "crosses are teams, white frames what yours see, yellow rings where your side was hurt.",
        ],
    ),
    (
        titles.of_features("A"),
        [
            "Feature layers of the screen of team A, row by row: height_map, visibility_map, creep",
            "power, pathable, buildable",
            "player_relative, unit_type, unit_hit_points_ratio.",
        ],
    ),
]


@pytest.mark.parametrize(("title", "parts"), TITLES)
def test_a_title_says_in_one_line_what_is_to_be_seen(title: str, parts: list[str]) -> None:
    assert title.split("; ") == parts
    assert "\n" not in title
