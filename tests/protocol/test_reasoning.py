"""Every part of the reader knows every pair of marks between which models reason."""

from __future__ import annotations

import re
import time

import pytest

from khala_protocol.reasoning import BEGIN, BLOCK_END, CHANNELS, END, FINAL, MARKS
from khala_protocol.speech import parse, thought_of
from khala_protocol.speech.whole import json_reply_of

EVERY = pytest.mark.parametrize(("begin", "end"), [*MARKS, CHANNELS])


def names(reply: str) -> list[str]:
    return [said.name for said in parse(reply).calls]


@EVERY
def test_orders_within_reasoning_are_not_read(begin: str, end: str) -> None:
    assert names(f"{begin}<Stop()>{end}<Go()>") == ["Go"]
    assert names(f"{begin.upper()}<Stop()>{end.upper()}<Go()>") == ["Go"]
    assert not names(f"{begin}<Stop()>")


@pytest.mark.parametrize("end", [end for _, end in MARKS])
def test_an_end_alone_ends_reasoning_that_began_in_the_prompt(end: str) -> None:
    assert names(f"<Stop()>{end}<Go()>") == ["Go"]


@EVERY
def test_headings_within_reasoning_do_not_end_a_thought(begin: str, end: str) -> None:
    reasoned = f"{begin}\nActions:\nnone?\n{end}"
    assert thought_of(f"{reasoned}\nI go.\nActions:\n<Go()>") == f"{reasoned}\nI go."


@EVERY
def test_an_object_behind_reasoning_is_the_whole_reply(begin: str, end: str) -> None:
    reply = json_reply_of(f'{begin}{{"x": 1}}{end}{{"analysis": "go", "orders": []}}')
    assert reply is not None
    assert reply.analysis == "go"


@pytest.mark.parametrize("pattern", [BEGIN, END, FINAL, BLOCK_END])
@pytest.mark.parametrize("part", ["<", "< ", "</ ", "<think ", "<|channel|> ", "<|channel|>final ", "[", "◁", "\n "])
def test_no_text_makes_a_search_long(pattern: str, part: str) -> None:
    search = re.compile(pattern, re.IGNORECASE).search
    began = time.process_time()
    assert search(part * (64_000 // len(part))) is None
    assert time.process_time() - began < 2
