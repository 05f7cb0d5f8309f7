"""An observation whose view is read late is the observation, whatever is done with it first."""

from __future__ import annotations

import copy
import pickle
from typing import TYPE_CHECKING

import pytest

from khala_protocol.codec import encode
from khala_protocol.errors import MalformedMessage, WrongVersion
from khala_protocol.messages import Observation, TeamView, View
from khala_protocol.unread import decode_observation

if TYPE_CHECKING:
    from collections.abc import Callable

READ = Observation(
    run="r", agent="Zealots", side="player1", episode=0, step=3, game_loop=24, answer_within_s=15, text="Game",
    view=View(time_s=1.5, teams=(TeamView(name="Zealot-1", minimap=(3.0, 4.5)),)),
)  # fmt: skip
BYTES = encode(READ)

USES: list[Callable[[Observation], object]] = [
    lambda seen: seen.view.teams[0].minimap,
    lambda seen: seen,
    vars,
    encode,
    repr,
    Observation.model_dump,
    Observation.model_copy,
    copy.copy,
    copy.deepcopy,
    lambda seen: pickle.loads(pickle.dumps(seen)),  # our own bytes
    lambda seen: seen.but(text="other").view,
]


@pytest.mark.parametrize("use", USES)
def test_it_is_used_as_one_that_was_read(use: Callable[[Observation], object]) -> None:
    assert use(decode_observation(BYTES)) == use(READ)
    assert use(READ) == use(decode_observation(BYTES))


def test_the_words_are_there_before_the_view_is_read() -> None:
    broken = decode_observation(BYTES.replace(b'"time_s"', b'"time"'))
    assert (broken.text, broken.step, broken.answer_within_s) == ("Game", 3, 15.0)
    for _ in range(2):
        with pytest.raises(MalformedMessage, match=r"view\.time_s"):
            _ = broken.view
    with pytest.raises(AttributeError, match="vieww"):
        _ = decode_observation(BYTES).vieww  # type: ignore[attr-defined]  # what is tested


@pytest.mark.parametrize(
    ("written", "instead", "error"),
    [
        (b'"text":"Game"', b'"text":5', MalformedMessage),
        (b'"text":"Game"', b'"text":"Game","more":1', MalformedMessage),
        (b'"kind":"observation"', b'"kind":"reply"', MalformedMessage),
        (b'"view":{', b'"view":7,"other":{', MalformedMessage),
        (b'"v":1', b'"v":2', WrongVersion),
        (b"}", b"", MalformedMessage),
    ],
)
def test_what_is_no_observation_is_refused_at_once(written: bytes, instead: bytes, error: type[Exception]) -> None:
    assert written in BYTES
    with pytest.raises(error):
        decode_observation(BYTES.replace(written, instead))
