"""The corpus of replies: each is read as a person would read it, and nothing is made up."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bench.language.recognition import Score, corpus, read, scores

if TYPE_CHECKING:
    import pytest

WANTED_SHARE = 0.995


def test_a_reply_is_read_as_a_person_would_read_it(subtests: pytest.Subtests) -> None:
    for name, entries in corpus().items():
        for entry in entries:
            with subtests.test(name, title=entry.title):
                found = read(entry)
                assert found.calls == list(entry.calls)
                assert found.messages == list(entry.messages)
                assert found.listens == list(entry.listens)
                assert found.rejections == list(entry.rejections)


def test_the_corpus_holds_hundreds_of_replies_and_each_of_them_once() -> None:
    replies = [entry for entries in corpus().values() for entry in entries]
    assert len(replies) >= 300
    assert len({(entry.reply, entry.roster) for entry in replies}) == len(replies)
    for name, entries in corpus().items():
        assert len({entry.title for entry in entries}) == len(entries), name


def test_what_is_not_meant_stands_in_its_reply() -> None:
    for entries in corpus().values():
        for entry in entries:
            assert [words for words in entry.not_meant if words not in entry.reply] == []


def test_meant_calls_are_found_and_none_is_invented() -> None:
    found = list(scores(list(corpus().items())).values())
    assert sum(score.found for score in found) >= WANTED_SHARE * sum(score.meant for score in found)
    assert sum(score.invented for score in found) == 0
    assert sum(score.rejected for score in found) == sum(score.rejections for score in found)


def test_a_score_counts_what_was_missed_and_what_was_made_up() -> None:
    score, entry = Score(), corpus()["plain"][0]
    reading = read(entry)
    score.add(entry, reading)
    assert (score.found, score.invented, score.exact) == (score.meant, 0, 1)
    reading.calls[0] = "Stalker-1 <Stop()>"
    score.add(entry, reading)
    assert (score.found, score.invented, score.exact) == (score.meant - 1, 1, 1)
