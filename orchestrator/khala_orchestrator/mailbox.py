"""Which messages each agent finds in its next observation.

A message goes into the next observation of its recipients: an agent of the same side by name, or every
agent of that side that listens to a channel, except the sender. A message without recipients
goes back to the sender as a rejection. An agent listens to a channel until the end of the episode.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_orchestrator.roster import Seat
from khala_protocol.messages import Message, Received, Rejection

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

MAX_CHARACTERS = 4000
"""Longer messages are cut: what one agent says is read by all others, and paid for by them."""


@dataclass(frozen=True, slots=True)
class Post:
    """The messages of a step: those delivered, by recipient in order of arrival, and those that could not be."""

    received: Mapping[Seat, tuple[Received, ...]] = field(default_factory=dict)
    rejections: Mapping[Seat, tuple[Rejection, ...]] = field(default_factory=dict)


class Mailbox:
    """The boxes of all agents, and the listeners of each channel."""

    def __init__(self, reach: Mapping[Seat, Sequence[Seat]], channels: Iterable[str] = ()) -> None:
        """Set the seats that each seat may write to, and the channels that every seat may write to."""
        self._reach = dict(reach)
        self._channels = tuple(channels)
        self._listeners: dict[tuple[str, str], list[Seat]] = defaultdict(list)

    def clear(self) -> None:
        """Forget all listeners, at the beginning of an episode."""
        self._listeners.clear()

    def listen(self, seat: Seat, channel: str) -> None:
        """Deliver what is said on `channel` to `seat` from now on; unknown channels stay silent."""
        listeners = self._listeners[seat.side, channel.casefold()]
        if seat not in listeners:
            listeners.append(seat)

    def deliver(self, messages: Iterable[Message]) -> Post:
        """Sort the messages of one step."""
        boxes: dict[Seat, list[Received]] = defaultdict(list)
        returned: dict[Seat, list[Rejection]] = defaultdict(list)
        for message in messages:
            sender = Seat(message.side, message.agent)
            recipients = self._recipients(sender, message.recipient)
            if recipients is None:
                returned[sender].append(self._return(sender, message))
                continue
            text = message.text[:MAX_CHARACTERS]
            for seat in recipients:
                boxes[seat].append(Received(sender=message.agent, recipient=message.recipient, text=text))
        return Post({s: tuple(m) for s, m in boxes.items()}, {s: tuple(r) for s, r in returned.items()})

    def _recipients(self, sender: Seat, name: str) -> list[Seat] | None:
        wanted = name.casefold()
        if wanted in (channel.casefold() for channel in self._channels):
            return [seat for seat in self._listeners[sender.side, wanted] if seat != sender]
        return [seat for seat in self._reach[sender] if seat.agent.casefold() == wanted] or None

    def _return(self, sender: Seat, message: Message) -> Rejection:
        names = [seat.agent for seat in self._reach[sender]] + list(self._channels)
        known = "you can write to " + ", ".join(names) if names else "there is nobody to write to"
        return Rejection(
            reason="unknown_recipient",
            message=f"You cannot write to {message.recipient!r}: {known}.",
            text=message.recipient,
            start=0,
        )
