"""Marks: which digits, and where they are put."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khala_bridge.knowledge import knowledge
from khala_bridge.observe.image.codes import code_of
from khala_bridge.observe.image.lettering import written
from khala_bridge.observe.image.marks import Marked, place
from khala_bridge.observe.mark_digits import mark_digits, marks_of


@pytest.mark.parametrize(
    ("tags", "marks"),
    [
        ([0x100140001], ["014"]),
        ([0x100140001, 0x100180001], ["014", "018"]),
        ([0x100140001, 0x110140003], ["0014", "1014"]),  # the same three digits
        ([0x100140001, 0x110140003, 0x100180001], ["0014", "1014", "018"]),
        ([0x7], ["000"]),
    ],
)
def test_a_mark_is_the_part_of_the_tag_before_its_last_four_digits(tags: list[int], marks: list[str]) -> None:
    assert list(marks_of(tags).values()) == marks


@given(st.sets(st.integers(0, 2**12 - 1), max_size=80), st.integers(0, 2**16 - 1))
def test_units_of_a_game_have_different_marks_that_stand_in_their_tags(numbers: set[int], used: int) -> None:
    tags = [(0x4000 | number) << 18 | used for number in numbers]  # as the game makes them
    marks = marks_of(tags)
    assert len(set(marks.values())) == len(tags)
    assert all(f"{tag:x}"[:-4].endswith(mark) for tag, mark in marks.items())
    assert all(mark in mark_digits(tag) for tag, mark in marks.items())  # what a picture shows can be read in a reply


def test_marks_of_units_apart_stand_to_the_right_of_their_bodies() -> None:
    image = np.zeros((200, 200, 3), np.uint8)
    units = [Marked("014", "enemy", 50, 50, 10), Marked("018", "team", 100, 150, 10)]
    assert place(image, units, units, 8) == units
    width, height = written("014", 8, (1, 1, 1), (0, 0, 0)).size
    for x, y in ((50, 50), (100, 150)):
        rows, columns = np.nonzero(image[y - 20 : y + 20, x - 30 : x + 60].any(axis=2))
        assert columns.min() + x - 30 == pytest.approx(x + 12, abs=1)
        assert np.ptp(columns) <= width
        assert (rows.min() + rows.max()) / 2 == pytest.approx(20, abs=height / 2)


def test_a_mark_of_a_large_body_stands_on_it() -> None:
    image = np.zeros((200, 200, 3), np.uint8)
    (placed,) = place(image, [Marked("014", "own", 100, 100, 50)], [], 8)
    rows, columns = np.nonzero(image.any(axis=2))
    assert placed.text == "014"
    assert (columns.min() + columns.max()) / 2 == pytest.approx(100, abs=1)
    assert rows.min() > 110
    assert rows.max() < 150


def test_no_two_marks_cover_each_other_by_more_than_half() -> None:
    image = np.zeros((400, 400, 3), np.uint8)
    units = [Marked(f"{k:03x}", "enemy", 150 + 14 * (k % 8), 150 + 14 * (k // 8), 7) for k in range(64)]
    placed = place(image, units, units, 8)
    width, height = written("000", 8, (1, 1, 1), (0, 0, 0)).size
    drawn = int(image.any(axis=2).sum())
    assert len(placed) > 40  # most of a swarm of 64 in a square of 5 by 5 units can be named
    assert drawn > 0.5 * 0.4 * len(placed) * width * height


def test_a_mark_never_leaves_the_picture_and_corners_have_theirs_inside() -> None:
    image = np.zeros((100, 100, 3), np.uint8)
    corners = [Marked("abc", "enemy", x, y, 6) for x in (2, 97) for y in (2, 97)]
    assert place(image, corners, corners, 8) == corners
    for x in (slice(0, 50), slice(50, 100)):
        for y in (slice(0, 50), slice(50, 100)):
            assert image[y, x].any()


def test_those_without_room_are_left_out() -> None:
    image = np.zeros((60, 60, 3), np.uint8)
    crowd = [Marked(f"{k:03x}", "enemy", 30, 30, 4) for k in range(40)]
    placed = place(image, crowd, crowd, 8)
    assert 0 < len(placed) < 40
    assert placed == crowd[: len(placed)]  # the first one has the room


def test_each_type_has_a_code_of_its_own() -> None:
    codes = [code_of(name) for name in knowledge()]
    assert len(set(codes)) == len(codes)
    assert {len(code) for code in codes} == {2}
    strange = [name for name, code in zip(knowledge(), codes, strict=True) if code[0] != name[0]]
    assert not [name for name in strange if knowledge()[name].weapons]  # those that fight keep their first letter


@pytest.mark.parametrize(
    ("name", "code"), [("Stalker", "ST"), ("Zealot", "ZE"), ("HighTemplar", "HT"), ("VoidRay", "VR"), ("Nobody", "??")]
)
def test_codes_remind_of_their_types(name: str, code: str) -> None:
    assert code_of(name) == code
