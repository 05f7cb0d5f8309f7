"""What an agent carries from one step to the next in its prompt.

An observation already reports the results of the last actions and the new messages, so no memory is a
good default; the memories here add earlier steps word for word. Any object with these three methods works.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Protocol

from khala_protocol.messages import ChatMessage

if TYPE_CHECKING:
    from khala_protocol.messages import Observation


class Memory(Protocol):
    """The memory of one agent."""

    def remember(self, observation: Observation, reply: str) -> None:
        """Note a step that was answered."""
        ...

    def recall(self) -> tuple[ChatMessage, ...]:
        """Return the messages of the prompt between the example and the new observation."""
        ...

    def clear(self) -> None:
        """Forget everything, at the beginning of an episode."""
        ...


class NoMemory:
    """A memory that remembers nothing."""

    def remember(self, observation: Observation, reply: str) -> None:
        """Do nothing."""

    def recall(self) -> tuple[ChatMessage, ...]:
        """Return nothing."""
        return ()

    def clear(self) -> None:
        """Do nothing."""


class LastSteps:
    """A memory of the last `count` observations and replies, unchanged, without their pictures."""

    def __init__(self, count: int) -> None:
        self._steps: deque[tuple[str, str]] = deque(maxlen=count)

    def remember(self, observation: Observation, reply: str) -> None:
        """Note a step, and forget the oldest if there are too many."""
        self._steps.append((observation.text, reply))

    def recall(self) -> tuple[ChatMessage, ...]:
        """Return a user and an assistant message per step, the oldest first."""
        return tuple(
            message
            for seen, said in self._steps
            for message in (ChatMessage(role="user", content=seen), ChatMessage(role="assistant", content=said))
        )

    def clear(self) -> None:
        """Forget everything."""
        self._steps.clear()
