"""What an agent carries from one step to the next, within its prompt.

An observation already tells what became of the last actions and which messages came, so that no memory is a
good default; what is here adds earlier steps word for word. Any object with these three methods will do.
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
        """Takes note of a step that was answered."""
        ...

    def recall(self) -> tuple[ChatMessage, ...]:
        """What stands in the prompt between the example and the new observation."""
        ...

    def clear(self) -> None:
        """Forgets everything, at the beginning of an episode."""
        ...


class NoMemory:
    """Remembers nothing."""

    def remember(self, observation: Observation, reply: str) -> None:
        """Does nothing."""

    def recall(self) -> tuple[ChatMessage, ...]:
        """Nothing."""
        return ()

    def clear(self) -> None:
        """Does nothing."""


class LastSteps:
    """Remembers observations and replies of the last `count` steps as they were, without their pictures."""

    def __init__(self, count: int) -> None:
        self._steps: deque[tuple[str, str]] = deque(maxlen=count)

    def remember(self, observation: Observation, reply: str) -> None:
        """Takes note of a step, and forgets the oldest if there are too many."""
        self._steps.append((observation.text, reply))

    def recall(self) -> tuple[ChatMessage, ...]:
        """A user and an assistant message a step, the oldest first."""
        return tuple(
            message
            for seen, said in self._steps
            for message in (ChatMessage(role="user", content=seen), ChatMessage(role="assistant", content=said))
        )

    def clear(self) -> None:
        """Forgets everything."""
        self._steps.clear()
