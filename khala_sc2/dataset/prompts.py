"""The prompt of a decision, as the policy that asks a language model makes it of a briefing and observations.

A prompt is a system message, the worked example of the briefing, earlier steps that the memory recalls, and the
observation. Two things are the model's own and cannot be made again: a summary of the game, and a memory that an agents
file gave to one agent. The memory of the task is there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_agents.memory import NoMemory, PromptMemory, memory_of
from khala_agents.prompt import Prompt

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_agents.detail import Detail
    from khala_protocol.messages import Briefing, ChatMessage, Observation


class Prompter:
    """The prompts of one agent, decision by decision.

    Args:
        detail: how much they say.
    """

    def __init__(self, detail: Detail = "full") -> None:
        self._detail: Detail = detail
        self._briefing: Briefing | None = None
        self._prompt: Prompt | None = None
        self._memory: PromptMemory = NoMemory()

    def messages(self, briefing: Briefing, observation: Observation) -> tuple[ChatMessage, ...]:
        """Return the prompt for an observation, with its pictures."""
        if self._prompt is None or briefing != self._briefing:
            self._briefing = briefing
            self._prompt = Prompt(briefing, detail=self._detail)
            self._memory = memory_of(briefing.memory)
        recalled = self._memory.recall(observation)
        return self._prompt.draft(
            observation.text, recalled=recalled.messages, steps=recalled.text, images=observation.images
        ).messages

    @property
    def example(self) -> Sequence[ChatMessage]:
        """The worked example of the last prompt: an observation and a reply."""
        return self._prompt.example if self._prompt else ()

    def remember(self, observation: Observation, reply: str) -> None:
        """Note a step that was answered, for the prompts to come."""
        self._memory.remember(observation, reply)


def count_example(prompt: Sequence[ChatMessage], example: Sequence[ChatMessage]) -> int:
    """Return how many messages after the first one of a prompt are the worked example: 2, or 0 if it has none.

    Only the observation of the example is compared, because the form of answers changes its reply.
    """
    return len(example) if example and len(prompt) > 1 and prompt[1].content == example[0].content else 0


def without_example(prompt: tuple[ChatMessage, ...], count: int) -> tuple[ChatMessage, ...]:
    """Return a prompt without its worked example of `count` messages."""
    return (*prompt[:1], *prompt[1 + count :])
