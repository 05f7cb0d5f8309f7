"""A rolling summary of the game, which an agent's model writes for itself every few decisions.

The request begins when a reply was sent, and runs beside the next decisions. Its answer stands in the prompts from the
third decision on, and is dropped if it has not come by then: a fixed place, so that a replay has it in the same
prompts. (The very next observation comes some milliseconds later where the game waits for agents; no model could make
it.) What counts is the traced exchange: a summary that was not recorded as answered is in no prompt.

`khala_agents.llm_policy` is above, and makes the request under its limits, its breaker and its budget.
"""

from __future__ import annotations

import asyncio
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from khala_agents.memory import StepInShort, end_step, minutes

if TYPE_CHECKING:
    from khala_protocol.messages import ModelCall, Observation

AFTER = 3
"""Decisions from the request of a summary to the first prompt with it."""
MOST_AT_ONCE = 3
"""Summaries whose steps one tells of, if those before it were dropped; of more the earliest steps are lost."""
MAX_CHARACTERS = 1_500
"""Longest summary; the rest is cut."""
_ASK = """\
Sum up the game so far for yourself, in at most 120 words: the plan, what worked, what was refused and why, what is \
known of the enemy, and what is still to do. You will read it above the next observations, in place of these steps. \
Write the summary alone, without actions and messages."""


@dataclass(slots=True)
class _Request:
    due: int
    """Number of the decision that may have it."""
    until_s: float
    """Time of the game that it tells of."""
    task: asyncio.Task[None] | None
    answer: str | None = None


class GameSummary:
    """The summary of one agent's episode.

    Args:
        every: number of decisions from one summary to the next; 0 for none.
    """

    def __init__(self, every: int) -> None:
        self.text = ""
        self._every = every
        self._until_s = 0.0
        self._decided = 0
        self._asked = 0
        self._steps: deque[StepInShort] = deque(maxlen=MOST_AT_ONCE * every)
        self._request: _Request | None = None

    @property
    def above(self) -> str:
        """What stands above the last steps in a prompt; "" without a summary."""
        if not self.text:
            return ""
        return f"Your summary of the game until {minutes(self._until_s)}\n{_indent(self.text)}"

    def begin_decision(self, observation: Observation) -> None:
        """Take in an observation before it is decided on, and the summary that is due by now."""
        if self._steps:
            end_step(self._steps[-1], observation)
        request = self._request
        if request is None or self._decided < request.due:
            return
        self._request = None
        if request.answer is not None:
            self.text, self._until_s = request.answer, request.until_s
            while self._steps and self._steps[0].time_s <= request.until_s:
                self._steps.popleft()
        elif request.task is not None:
            request.task.cancel()

    def end_decision(self, observation: Observation, reply: str) -> None:
        """Take in a step that was answered; a second reply to an observation takes the place of the first."""
        if not self._every:
            return
        if observation.verdict is None:
            self._decided += 1
        elif self._steps:
            self._steps.pop()  # the reply before, which does not count
        self._steps.append(StepInShort.of(observation, reply))

    @property
    def is_due(self) -> bool:
        """Whether a summary is to be asked for now, after a reply."""
        if not self._every or self._decided == self._asked or self._request is not None:
            return False
        return self._decided % self._every == 0

    def ask(self, observation: Observation) -> str:
        """Return the question for a new summary; the running task is the one that gets the answer."""
        self._asked = self._decided
        due = self._decided + AFTER - 1
        self._request = _Request(due, observation.view.time_s, asyncio.current_task())
        before = f"\nYour summary until now\n{_indent(self.text)}" if self.text else ""
        lines = "\n".join(line for step in self._steps for line in step.lines())
        return f"{_ASK}\n{before}\nYour steps\n{lines}\n"

    def note(self, exchange: ModelCall) -> None:
        """Take the answer from a traced exchange."""
        if self._request is not None and exchange.status == "ok" and exchange.completion:
            self._request.answer = exchange.completion.strip()[:MAX_CHARACTERS]


def _indent(text: str) -> str:
    return "".join(f"    {line}\n" for line in text.splitlines())
