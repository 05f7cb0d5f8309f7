"""Which messages each agent finds in its next observation.

A message goes into the next observation of its recipients: an agent of the same side by name, or every
agent of that side that listens to a channel, except the sender. A message without recipients
goes back to the sender as a rejection. An agent listens to a channel until the end of the episode. An adviser's
message goes the same way, may be for `everyone`, and says with the sender's name that it comes from an adviser.

What one agent says is read by others, and paid for by them. So the number of messages of a sender in a step is limited,
and so are the characters that a recipient gets in a step, from each sender and in total; the sender reads how many of
its messages were not delivered. The recording has the whole reply.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_orchestrator.roster import Seat
from khala_protocol.messages import Message, Received, Rejection

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

MAX_MESSAGES = 5
"""Number of messages of a sender that count in a step."""
MAX_CHARACTERS = 1_500
"""Characters that a recipient gets from one sender in a step; the rest is cut. The shortest observation has 1 900."""
MAX_RECEIVED_CHARACTERS = 6_000
"""Characters that a recipient gets in a step, in equal parts from all that write to it."""
EVERYONE = "everyone"
"""Recipient of an adviser's message that is for all agents of the side."""


@dataclass(frozen=True, slots=True)
class Post:
    """The messages of a step."""

    taken: Sequence[Message] = ()
    """Those that count, in order of arrival."""
    received: Mapping[Seat, tuple[Received, ...]] = field(default_factory=dict)
    """Those delivered, by recipient in order of arrival."""
    rejections: Mapping[Seat, tuple[Rejection, ...]] = field(default_factory=dict)
    """Those that could not be, by sender."""


class Mailbox:
    """The boxes of all agents, and the listeners of each channel."""

    def __init__(
        self,
        reach: Mapping[Seat, Sequence[Seat]],
        channels: Iterable[str] = (),
        advisers: Mapping[Seat, str] | None = None,
    ) -> None:
        """Set who may write to which seats, the channels that all may write to, and the roles of advisers."""
        self._advisers = dict(advisers or {})
        self._reach = {**reach, **dict.fromkeys(self._advisers, tuple(reach))}
        self._channels = {channel.casefold(): channel for channel in channels}
        self._listeners: dict[tuple[str, str], list[Seat]] = defaultdict(list)

    def clear(self) -> None:
        """Forget all listeners, at the beginning of an episode."""
        self._listeners.clear()

    def listen(self, seat: Seat, channel: str) -> Rejection | None:
        """Deliver what is said on `channel` to `seat` from now on; return what is wrong with an unknown one."""
        name = channel.casefold()
        if name not in self._channels:
            known = "the channels are " + ", ".join(self._channels.values()) if self._channels else "there is none"
            message = f"There is no channel {channel!r}: {known}."
            return Rejection(reason="unknown_recipient", message=message, text=channel, start=0)
        if seat not in self._listeners[seat.side, name]:
            self._listeners[seat.side, name].append(seat)
        return None

    def deliver(self, messages: Iterable[Message]) -> Post:
        """Sort the messages of one step."""
        boxes: dict[Seat, list[Message]] = defaultdict(list)
        returned: dict[Seat, list[Rejection]] = defaultdict(list)
        said: Counter[Seat] = Counter()
        taken: list[Message] = []
        for message in messages:
            sender = _sender(message)
            said[sender] += 1
            if said[sender] > MAX_MESSAGES:
                continue
            taken.append(message)
            recipients = self._recipients(sender, message.recipient)
            if recipients is None:
                returned[sender].append(self._return(sender, message))
            for seat in recipients or ():
                boxes[seat].append(message)
        for sender, number in said.items():
            if number > MAX_MESSAGES:
                returned[sender].append(_too_many(number))
        received = {seat: tuple(self._fitting(seat, box)) for seat, box in boxes.items()}
        return Post(taken, received, {seat: tuple(rejections) for seat, rejections in returned.items()})

    def _recipients(self, sender: Seat, name: str) -> list[Seat] | None:
        wanted = name.casefold()
        if wanted in self._channels:
            return [seat for seat in self._listeners[sender.side, wanted] if seat != sender]
        if sender in self._advisers and wanted == EVERYONE:
            return list(self._reach[sender])
        return [seat for seat in self._reach[sender] if seat.agent.casefold() == wanted] or None

    def _return(self, sender: Seat, message: Message) -> Rejection:
        names = [seat.agent for seat in self._reach[sender]] + list(self._channels.values())
        known = "you can write to " + ", ".join(names) if names else "there is nobody to write to"
        return Rejection(
            reason="unknown_recipient",
            message=f"You cannot write to {message.recipient!r}: {known}.",
            text=message.recipient,
            start=0,
        )

    def _fitting(self, seat: Seat, box: Sequence[Message]) -> Iterator[Received]:
        """Yield the messages for one recipient, cut to each sender's part of what it gets in a step."""
        senders = {message.agent for message in box}
        left = dict.fromkeys(senders, min(MAX_CHARACTERS, MAX_RECEIVED_CHARACTERS // len(senders)))
        for message in box:
            room = left[message.agent]
            if room:
                text = message.text if len(message.text) <= room else message.text[: room - 1] + "…"
                left[message.agent] -= len(text)
                recipient = message.recipient if message.recipient.casefold() != EVERYONE else seat.agent
                yield Received(sender=self._signature(message), recipient=recipient, text=text)

    def _signature(self, message: Message) -> str:
        """Return the sender's name, of an adviser with the role: no agent's name has brackets."""
        return f"{message.agent} ({self._advisers[_sender(message)]})" if message.human else message.agent


def newest(messages: Sequence[Received]) -> tuple[Received, ...]:
    """Return the newest messages of several steps, as far as an observation has room for them."""
    room = MAX_RECEIVED_CHARACTERS
    kept = 0
    for message in reversed(messages):
        room -= len(message.text)
        if room < 0:
            break
        kept += 1
    return tuple(messages[len(messages) - kept :])


def _too_many(number: int) -> Rejection:
    """Return the rejection of the messages over the limit."""
    what = f"{number - MAX_MESSAGES} of your {number} messages were not delivered"
    return Rejection(reason="too_many_messages", message=f"{what}: write at most {MAX_MESSAGES}.", text="", start=0)


def _sender(message: Message) -> Seat:
    return Seat(message.side, message.agent)
