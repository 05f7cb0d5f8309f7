"""No text takes the reader more than linear time: every short token of the language, and mixtures of them, repeated."""

from __future__ import annotations

import itertools
import random
import time

import pytest

from bench.survival.hostile import TOKENS
from khala_protocol.speech import MAX_REPLY_CHARACTERS, ShownText, echoes, parse

PAIRS = list(itertools.product(TOKENS, TOKENS))
"""5 300; a long test tries 240 of them."""
PREFIXES = ("", "Actions:\n<Stop()>\n", "Actions:\nA:")
FOUND = (  # each was quadratic, or worse, before
    *("A_", "A_A_", "Aa_bAa_b", "<!--", "[\n", ". Actions: A1| ", '{"action":"A_b"}A1| ', "\nMessageTo(A, x"),
    *("<MessageTo (A, x", "<MessageTo (A, x<a(x)>", "<MessageTo(A," + " " * 170 + "'x", "<MessageTo> ,x"),
    *("Final actions:\n<A_b()>\n", "<A_b([1, 2], [3, 4])>\n", "<A_b()> and more words, "),
)
SHOWN = ShownText("Team A: <A_b()>, <C_d(tag)>\n- <A_b()>: Stop moving and firing\nTeam B: " + "<A_b()>, " * 60)
"""What repeats it is looked up for each call."""
NOTICED_S = 0.02
"""Less time is noise."""


def seconds(text: str) -> float:
    begin = time.thread_time()
    parse(text, SHOWN)
    return time.thread_time() - begin


def growth(piece: str, prefix: str, long: int) -> float:
    """Return how many times as long a text takes that is four times as long."""
    short, long_text = ((prefix + piece * (size // len(piece) + 1))[:size] for size in (long // 4, long))
    took_s = seconds(long_text)
    return took_s / min(seconds(short) for _ in range(3)) if took_s >= NOTICED_S else 0.0


def is_linear(piece: str, prefix: str, long: int = MAX_REPLY_CHARACTERS // 4) -> bool:
    return any(growth(piece, prefix, long) < 8 for _ in range(5))  # 4 if it is linear, 16 if it is quadratic


@pytest.mark.parametrize("prefix", [PREFIXES[1], pytest.param(PREFIXES[2], marks=pytest.mark.slow)])
@pytest.mark.parametrize("piece", FOUND)
def test_what_was_slow_takes_linear_time(piece: str, prefix: str) -> None:
    assert is_linear(piece, prefix, MAX_REPLY_CHARACTERS)


@pytest.mark.slow
@pytest.mark.parametrize("token", TOKENS)
def test_no_token_takes_more_than_linear_time(token: str) -> None:
    assert all(is_linear(token, prefix) for prefix in PREFIXES)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_no_two_tokens_take_more_than_linear_time(seed: int) -> None:
    chance = random.Random(seed)
    units = ("".join(pair) for pair in chance.sample(PAIRS, 40))
    assert not [unit for unit in units if not is_linear(unit, chance.choice(PREFIXES))]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_no_mixture_of_tokens_takes_more_than_linear_time(seed: int) -> None:
    chance = random.Random(seed)
    units = ("".join(chance.choices(TOKENS, k=chance.choice((3, 3, 4, 5)))) for _ in range(50))
    assert not [unit for unit in units if not is_linear(unit, chance.choice(PREFIXES))]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_many_openings_and_a_far_end_take_linear_time(seed: int) -> None:
    chance = random.Random(seed)
    for token, other in chance.sample(PAIRS, 40):
        prefix = chance.choice(PREFIXES)
        texts = (prefix + token * (size // len(token)) + other * (size // len(other)) for size in (8_192, 32_768))
        short, long = (min(seconds(text) for _ in range(2)) for text in texts)
        assert long < max(10 * short, 2 * NOTICED_S), (token, other)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x" * MAX_REPLY_CHARACTERS + "<Stop()>", "the reply is longer than 65536 characters"),
        ("<Stop()>" * 1_001, "the reply has more than 1000 calls"),
        ("x\n" * 4_000 + "<Stop()>", "the reply has more than 4000 lines"),
    ],
    ids=["characters", "calls", "lines"],
)
def test_what_is_not_read_of_a_reply_is_reported(text: str, message: str) -> None:
    fault = parse(text).faults[-1]
    assert (fault.reason, fault.text) == ("malformed", "<Stop()>")
    assert fault.message == f"{message}, the rest of it was not read: write less"
    assert text[fault.start :] == "<Stop()>"


def test_all_calls_up_to_the_limit_are_read() -> None:
    assert (len(parse("<Stop()>" * 1_000).calls), parse("<Stop()>" * 1_000).faults) == (1_000, ())


@pytest.mark.parametrize("entity", ["&#" + "9" * 5_000 + ";", "&#x" + "f" * 5_000 + ";"])
def test_an_entity_with_too_many_digits_is_text(entity: str) -> None:
    (message,) = parse(f"<MessageTo(A, 'go {entity} on')>").messages
    assert message.text == f"go {entity} on"


def test_a_long_line_is_not_compared_with_shown_lists_once_for_each_call(monkeypatch: pytest.MonkeyPatch) -> None:
    compared: list[int] = []
    plain = echoes._plain  # what a comparison costs

    def count(words: str) -> str:
        compared.append(len(words))
        return plain(words)

    monkeypatch.setattr(echoes, "_plain", count)
    text = "<A_b()> and more words, " * 600
    parse(text, SHOWN)
    assert 0 < sum(compared) < 20 * len(text)  # 600 times its length if each call took the whole line
