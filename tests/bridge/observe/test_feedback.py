"""What a reply adds to the next observations: bounded, and no part of it passes for other text."""

from __future__ import annotations

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from khala_bridge.observe import shorten
from khala_bridge.observe.feedback import MAX_CHARACTERS
from khala_bridge.observe.text import reply
from khala_protocol.messages import Received, Rejection, count_refusals


def rejection(text: str = "<Go()>", **fields: Any) -> Rejection:
    values = {"reason": "unknown_action", "message": "There is no action Go.", "text": text, "start": 0}
    return Rejection.model_validate(values | fields)


def test_few_rejections_are_listed_as_they_are() -> None:
    few = [rejection(f"<Go{number}()>") for number in range(10)]
    assert shorten(few) == tuple(few)


def test_of_many_rejections_the_others_are_counted_by_reason() -> None:
    many = [rejection(f"<Go{number}()>") for number in range(4_600)]
    *listed, last = shorten([*many, rejection(reason="malformed")])
    assert listed == many[:10]
    assert (last.reason, last.text) == ("unknown_action", "")
    assert last.message == "4591 more are not listed: 4590 unknown_action, 1 malformed."
    assert count_refusals([*listed, last]) == {"unknown_action": 4_600, "malformed": 1}


def test_the_same_rejection_is_listed_once_and_counted() -> None:
    one, other = shorten([rejection()] * 3 + [rejection("<Run()>")])
    assert one.message == "There is no action Go. (so 3 times in this answer)"
    assert (other, count_refusals([one, other])) == (rejection("<Run()>"), {"unknown_action": 4})


def test_long_words_are_cut() -> None:
    (short,) = shorten([rejection("x" * 60_000, message="y" * 60_000, team="z" * 60_000)])
    assert (len(short.text), len(short.message), len(short.team or "")) == (120, 400, 60)
    assert short.text[-1] == "…"


def test_all_rejections_together_have_only_so_many_characters() -> None:
    found = shorten([rejection("x" * 60_000, message="y" * 60_000)] * 4_600)
    assert sum(len(one.text) + len(one.message) for one in found) < MAX_CHARACTERS + 100


@given(st.text(st.sampled_from("'\"\n\r\x0b\x0c\x1c\x85\u2028 ab<>/"), max_size=60))
def test_no_message_passes_for_other_text(text: str) -> None:
    line = f"    {reply._message(Received(sender='Zealots', recipient='Stalkers', text=text), 'Stalkers')}"
    assert line.splitlines() == [line]
    assert line.startswith("    Message from Zealots: '''")
    assert line.endswith("'''")
    assert "'''" not in line.removeprefix("    Message from Zealots: '''").removesuffix("'''").strip("'")


@given(st.text(st.sampled_from("'\"\n\r\x0b\x0c\x1c\x85\u2028 ab<>/"), max_size=60))
def test_no_rejection_has_several_lines(text: str) -> None:
    line = reply.rejection_line(rejection(text, message=text, team=text))
    assert line.splitlines() == [line] or not line
