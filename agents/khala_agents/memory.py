"""What an agent carries from one step to the next in its prompt.

An observation already reports the results of the last actions and the new messages, so no memory is a good default.
The memories here add earlier steps, in short or word for word. Any object with these methods works. The summary of
the game is another matter, for a model makes it: `khala_agents.summary`.
"""

from __future__ import annotations

import re
from collections import deque
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, NamedTuple, Protocol

from khala_protocol.messages import ChatMessage
from khala_protocol.reasoning import END, FINAL

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_protocol.messages import MemoryRule, Observation, Received, Rejection

MAX_THOUGHT_CHARACTERS = 200
"""Longest first sentence of an analysis; the rest is cut."""
_REASONED = re.compile(rf"{END}|{FINAL}", re.IGNORECASE)
_SENTENCE = re.compile(r"[^\n]*?[.!?。](?=\s|$)|[^\n]*")


class Recalled(NamedTuple):
    """What a memory adds to a prompt."""

    messages: tuple[ChatMessage, ...] = ()
    """Between the example and the new observation."""
    text: str = ""
    """Above the observation, in its message."""


class PromptMemory(Protocol):
    """The memory of one agent."""

    def remember(self, observation: Observation, reply: str) -> None:
        """Note a step that was answered."""
        ...

    def recall(self, observation: Observation) -> Recalled:
        """Return what the prompt for a new observation has of the steps before."""
        ...

    def clear(self) -> None:
        """Forget everything, at the beginning of an episode."""
        ...


class NoMemory:
    """A memory that remembers nothing."""

    def remember(self, observation: Observation, reply: str) -> None:
        """Do nothing."""

    def recall(self, observation: Observation) -> Recalled:  # noqa: ARG002  # as in Memory
        """Return nothing."""
        return Recalled()

    def clear(self) -> None:
        """Do nothing."""


class WholeSteps:
    """A memory of the last `count` observations and replies, word for word, without their pictures."""

    def __init__(self, count: int) -> None:
        self._steps: deque[tuple[str, str]] = deque(maxlen=count)

    def remember(self, observation: Observation, reply: str) -> None:
        """Note a step, and forget the oldest if there are too many."""
        self._steps.append((observation.text, reply))

    def recall(self, observation: Observation) -> Recalled:  # noqa: ARG002  # as in Memory
        """Return a user and an assistant message per step, the oldest first."""
        return Recalled(
            tuple(
                message
                for seen, said in self._steps
                for message in (ChatMessage(role="user", content=seen), ChatMessage(role="assistant", content=said))
            )
        )

    def clear(self) -> None:
        """Forget everything."""
        self._steps.clear()


@dataclass(slots=True)
class StepInShort:
    """One step in short: what was thought, said and heard, and what became of the orders."""

    time_s: float
    thought: str
    wrote: tuple[str, ...]
    messages: tuple[Received, ...]
    """Those that no earlier observation had."""
    after: Observation | None = None
    """The next observation, which says what was accepted and refused."""

    @classmethod
    def of(cls, observation: Observation, reply: str) -> StepInShort:
        """Return what is kept of a step."""
        from khala_protocol.speech import parse  # noqa: PLC0415  # its patterns take 0.15 s, for agents with a memory

        wrote = tuple(f"to {said.recipient}: {_line(said.text)}" for said in parse(reply).messages)
        new = tuple(message for message in observation.messages if not message.again)
        return cls(observation.view.time_s, first_sentence(reply), wrote, new)

    def lines(self) -> Iterator[str]:
        """Yield the step as a prompt has it."""
        yield f"    {minutes(self.time_s)} {self.thought}".rstrip()
        yield from (f"        read from {message.sender}: {_line(message.text)}" for message in self.messages)
        yield from (f"        wrote {words}" for words in self.wrote)
        if self.after is not None:
            yield from (f"        done: {call}" for call in self.after.accepted)
            yield from (f"        refused: {_refusal(rejection)}" for rejection in self.after.rejections)


class ShortSteps:
    """A memory of the last `count` steps in short form, one block of text above the observation."""

    def __init__(self, count: int) -> None:
        self._steps: deque[StepInShort] = deque(maxlen=count)

    def remember(self, observation: Observation, reply: str) -> None:
        """Note a step, and forget the oldest if there are too many."""
        self._steps.append(StepInShort.of(observation, reply))

    def recall(self, observation: Observation) -> Recalled:
        """Return the steps, the oldest first; the new observation itself says what became of the last one."""
        if not self._steps:
            return Recalled()
        lines = ["Your last steps", *(line for step in self._steps for line in step.lines())]
        end_step(self._steps[-1], observation)
        return Recalled(text="\n".join(lines) + "\n")

    def clear(self) -> None:
        """Forget everything."""
        self._steps.clear()


def memory_of(rule: MemoryRule) -> PromptMemory:
    """Return the memory that a rule asks for."""
    if not rule.steps:
        return NoMemory()
    return WholeSteps(rule.steps) if rule.whole else ShortSteps(rule.steps)


def end_step(step: StepInShort, observation: Observation) -> None:
    """Note the observation that follows a step; only the first one says what became of it."""
    if step.after is None:
        step.after = observation


def first_sentence(reply: str) -> str:
    """Return the first sentence of a reply's analysis; of the reply, if it has no such heading; "" for mere calls."""
    said = _REASONED.split(reply)[-1]
    heading = _analysis().search(said)
    rest = said[heading.end() :] if heading else said.lstrip()
    found = _SENTENCE.match(rest)
    sentence = _line(found[0] if found else "")
    if not heading and (sentence.startswith("<") or sentence.endswith(":")):
        return ""
    return _cut(sentence, MAX_THOUGHT_CHARACTERS)


@cache
def _analysis() -> re.Pattern[str]:
    from khala_protocol.speech.words import ANALYSIS  # noqa: PLC0415  # as above

    return re.compile(rf"^[*_#\s]*(?:{ANALYSIS})\b[*_\s]*[:\uff1a]?[*_]*\s*", re.IGNORECASE | re.MULTILINE)


def minutes(seconds: float) -> str:
    """Return a time of the game as `1:05`."""
    return f"{int(seconds) // 60}:{int(seconds) % 60:02}"


def _refusal(rejection: Rejection) -> str:
    words = _line(f"{rejection.team} {rejection.text}" if rejection.team else rejection.text)
    return f"{words} ({_line(rejection.message)})" if words else _line(rejection.message)


def _line(text: str) -> str:
    return " ".join(text.split())


def _cut(text: str, longest: int) -> str:
    return text if len(text) <= longest else text[: longest - 1] + "…"
