from __future__ import annotations

import pytest

from khala_orchestrator.roster import Seat
from khala_orchestrator.words.mailbox import MAX_CHARACTERS, Mailbox
from khala_protocol.messages import Message

A, B, C, FOE = Seat("p1", "A"), Seat("p1", "B"), Seat("p1", "C"), Seat("p2", "B")


def said(sender: Seat, recipient: str, text: str = "hi") -> Message:
    return Message(run="r", side=sender.side, agent=sender.agent, episode=0, step=0, recipient=recipient, text=text)


@pytest.fixture
def mailbox() -> Mailbox:
    box = Mailbox({A: [B, C], B: [A, C], C: [A], FOE: []}, ["Channel-1"])
    box.listen(A, "channel-1")
    box.listen(B, "Channel-1")
    return box


@pytest.mark.parametrize(
    ("sender", "recipient", "hears"),
    [
        (A, "B", [B]),
        (A, "b", [B]),
        (A, "Channel-1", [B]),
        (C, "channel-1", [A, B]),
        (FOE, "Channel-1", []),
    ],
    ids=["by name", "in any case", "not the sender itself", "all listeners", "not the other side"],
)
def test_who_hears(mailbox: Mailbox, sender: Seat, recipient: str, hears: list[Seat]) -> None:
    post = mailbox.deliver([said(sender, recipient)])
    assert list(post.received) == hears
    assert not post.rejections


def test_messages_of_several_senders_keep_their_order(mailbox: Mailbox) -> None:
    post = mailbox.deliver([said(A, "C", "1"), said(B, "C", "2"), said(A, "C", "3")])
    assert [(m.sender, m.text) for m in post.received[C]] == [("A", "1"), ("B", "2"), ("A", "3")]


@pytest.mark.parametrize("recipient", ["Nobody", "A", ""], ids=["unknown", "oneself", "empty"])
def test_a_message_to_nobody_goes_back_with_the_names_one_can_write_to(mailbox: Mailbox, recipient: str) -> None:
    post = mailbox.deliver([said(A, recipient)])
    (rejection,) = post.rejections[A]
    assert rejection.reason == "unknown_recipient"
    assert rejection.message == f"You cannot write to {recipient!r}: you can write to B, C, Channel-1."


def test_who_may_not_be_written_to_hears_nothing(mailbox: Mailbox) -> None:
    post = mailbox.deliver([said(C, "B")])
    assert not post.received
    assert [r.message for r in post.rejections[C]] == ["You cannot write to 'B': you can write to A, Channel-1."]


def test_a_long_message_is_cut(mailbox: Mailbox) -> None:
    post = mailbox.deliver([said(A, "B", "x" * 10_000)])
    assert len(post.received[B][0].text) == MAX_CHARACTERS


def test_listening_ends_with_the_episode(mailbox: Mailbox) -> None:
    mailbox.clear()
    assert not mailbox.deliver([said(C, "Channel-1")]).received


def test_one_that_may_write_to_nobody_is_told_so() -> None:
    post = Mailbox({A: []}).deliver([said(A, "B")])
    assert [r.message for r in post.rejections[A]] == ["You cannot write to 'B': there is nobody to write to."]


def test_a_rejection_names_the_recipient_as_it_was_written(mailbox: Mailbox) -> None:
    (rejection,) = mailbox.deliver([said(A, "nOBODY")]).rejections[A]
    assert (rejection.text, rejection.start) == ("nOBODY", 0)


def test_one_that_listens_twice_hears_once(mailbox: Mailbox) -> None:
    mailbox.listen(B, "CHANNEL-1")
    assert [m.text for m in mailbox.deliver([said(C, "Channel-1")]).received[B]] == ["hi"]


def test_an_unknown_channel_can_be_listened_to_and_not_written_to(mailbox: Mailbox) -> None:
    fault = mailbox.listen(B, "Channel-9")
    assert fault is not None
    assert fault.message == "There is no channel 'Channel-9': the channels are Channel-1."
    post = mailbox.deliver([said(A, "Channel-9")])
    assert not post.received
    assert list(post.rejections) == [A]


def test_a_channel_that_nobody_listens_to_swallows_what_is_said(mailbox: Mailbox) -> None:
    mailbox.clear()
    post = mailbox.deliver([said(A, "Channel-1")])
    assert (dict(post.received), dict(post.rejections)) == ({}, {})


def test_a_recipient_reads_from_whom_a_message_is_and_how_it_was_addressed(mailbox: Mailbox) -> None:
    post = mailbox.deliver([said(C, "channel-1"), said(A, "b")])
    assert [(m.sender, m.recipient) for m in post.received[B]] == [("C", "channel-1"), ("A", "b")]


def test_channels_have_the_name_before_agents() -> None:
    box = Mailbox({A: [B], B: [A], C: []}, ["B"])
    box.listen(C, "B")
    assert list(box.deliver([said(A, "B")]).received) == [C]


def test_each_side_has_its_channels_to_itself() -> None:
    box = Mailbox({A: [], FOE: []}, ["Channel-1"])
    box.listen(FOE, "Channel-1")
    assert not box.deliver([said(A, "Channel-1")]).received


def test_nothing_said_is_nothing_delivered(mailbox: Mailbox) -> None:
    post = mailbox.deliver([])
    assert (dict(post.received), dict(post.rejections)) == ({}, {})


def test_a_sender_has_a_few_messages_in_a_step_and_reads_how_many_were_not_delivered(mailbox: Mailbox) -> None:
    post = mailbox.deliver([said(A, "B", str(number)) for number in range(1_200)])
    assert [m.text for m in post.received[B]] == list("01234")
    assert [m.text for m in post.taken] == list("01234")
    (rejection,) = post.rejections[A]
    assert rejection.reason == "too_many_messages"
    assert rejection.message == "1195 of your 1200 messages were not delivered: write at most 5."


def test_a_sender_has_only_so_many_characters_for_a_recipient(mailbox: Mailbox) -> None:
    post = mailbox.deliver([said(A, "B", "x" * 1_000), said(C, "Channel-1"), *[said(A, "B", "y" * 1_000)] * 2])
    assert [(m.sender, len(m.text), m.text[-1]) for m in post.received[B]] == [
        ("A", 1_000, "x"),
        ("C", 2, "i"),
        ("A", MAX_CHARACTERS - 1_000, "…"),
    ]


def test_what_a_recipient_gets_is_limited_and_shared_in_equal_parts() -> None:
    senders = [Seat("p1", f"S{number}") for number in range(12)]
    post = Mailbox({seat: [A] for seat in senders}).deliver([said(seat, "A", "x" * 9_000) for seat in senders])
    assert [len(m.text) for m in post.received[A]] == [500] * 12


def test_listening_to_unknown_channels_is_not_remembered(mailbox: Mailbox) -> None:
    for number in range(100):
        mailbox.listen(A, f"Channel-{number}")
    assert len(mailbox._listeners) == 1


ADA = Seat("p1", "Ada")


def advice(recipient: str, text: str = "hi") -> Message:
    return said(ADA, recipient, text).model_copy(update={"human": True})


@pytest.mark.parametrize(
    ("recipient", "hears"), [("everyone", [A, B]), ("b", [B]), ("Channel-1", [A])], ids=["all", "one", "listeners"]
)
def test_an_adviser_is_heard_under_name_and_role(recipient: str, hears: list[Seat]) -> None:
    box = Mailbox({A: [], B: []}, ["Channel-1"], {ADA: "a human coach"})
    box.listen(A, "Channel-1")
    post = box.deliver([advice(recipient)])
    assert list(post.received) == hears
    assert {message.sender for messages in post.received.values() for message in messages} == {"Ada (a human coach)"}


def test_only_an_adviser_writes_to_everyone() -> None:
    post = Mailbox({A: [B], B: [A]}, (), {ADA: "coach"}).deliver([said(A, "everyone")])
    assert not post.received
    assert [rejection.reason for rejection in post.rejections[A]] == ["unknown_recipient"]


def test_an_adviser_has_the_limits_of_an_agent() -> None:
    post = Mailbox({A: []}, (), {ADA: "coach"}).deliver(advice("A", "x" * 400) for _ in range(9))
    assert len(post.taken) == 5
    assert sum(len(message.text) for message in post.received[A]) == MAX_CHARACTERS
