"""The errors: the tree matches its picture, and a place precedes the sentence."""

from __future__ import annotations

import inspect
import pickle
import re

import pytest

from khala_protocol import errors
from khala_protocol.errors import BusClosed, BusError, ConfigError, KhalaError, PeerError, RecordingError, WrongVersion

CLASSES = [one for _, one in inspect.getmembers(errors, inspect.isclass) if one.__module__ == errors.__name__]


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (ConfigError("must be a number"), "must be a number"),
        (ConfigError("must be a number", source="task.yaml"), "task.yaml: must be a number"),
        (ConfigError("must be a number", source="task.yaml", line=7), "task.yaml:7: must be a number"),
        (
            ConfigError("must be a number", source="task.yaml", line=7, field="clock.max_wait_s"),
            "task.yaml:7 (clock.max_wait_s): must be a number",
        ),
        (
            ConfigError("must be a number", source="task.yaml", field="clock.max_wait_s"),
            "task.yaml (clock.max_wait_s): must be a number",
        ),
        (ConfigError("must be a number", field="clock.max_wait_s"), "clock.max_wait_s: must be a number"),
        (ConfigError("must be a number", line=7), "line 7: must be a number"),
        (ConfigError("is not set", source="$LLM_API_KEY"), "$LLM_API_KEY: is not set"),
        (BusClosed("the bus is closed"), "the bus is closed"),
        (RecordingError("x is empty"), "x is empty"),
    ],
)
def test_an_error_says_where_in_front_of_what(error: KhalaError, text: str) -> None:
    assert str(error) == text


def test_a_place_can_be_read_from_the_error() -> None:
    error = ConfigError("must be a number", source="task.yaml", line=7, field="a.b")
    assert (error.source, error.line, error.field) == ("task.yaml", 7, "a.b")


def test_the_picture_of_the_tree_is_the_tree() -> None:
    drawn = re.findall(r"^    ([│├└─ ]*)(\w+)", errors.__doc__ or "", re.MULTILINE)
    parents: list[str] = []
    edges = set()
    for indent, name in drawn:
        depth = len(indent) // 4
        parents[depth:] = [name]
        edges.add((name, parents[depth - 1] if depth else "Exception"))
    assert edges == {(one.__name__, one.__bases__[0].__name__) for one in CLASSES}


@pytest.mark.parametrize(
    ("error", "base"),
    [(BusClosed, BusError), (WrongVersion, PeerError), (PeerError, KhalaError), (BusError, KhalaError)],
)
def test_whose_fault_it_is_can_be_caught_by_type(error: type[KhalaError], base: type[KhalaError]) -> None:
    with pytest.raises(base):
        raise error("text")


@pytest.mark.parametrize("error", CLASSES, ids=lambda one: one.__name__)
def test_every_error_keeps_its_text_through_another_process(error: type[KhalaError]) -> None:
    assert str(pickle.loads(pickle.dumps(error("one sentence")))) == "one sentence"
    assert error.__doc__
