"""What became of each agent's calls, by the action that they name."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from khala_sc2.experiment.measures.evidence import SideStep

_NAME = re.compile(r"<\s*/?(\w{1,40})")
NAMELESS = "?"
"""The action of a rejection whose words name none."""


@dataclass(frozen=True, slots=True)
class CallCount:
    """How often the calls of an agent that name an action ended in one way."""

    agent: str
    action: str
    became: str
    """`accepted`, or the reason of the rejection."""
    count: int


class CallTally:
    """The running account of an episode."""

    def __init__(self) -> None:
        self._counts: Counter[tuple[str, str, str]] = Counter()

    def add(self, step: SideStep) -> None:
        """Take in a step."""
        for agent in step.report.agents:
            self._counts.update((agent.agent, _action(call), "accepted") for call in agent.accepted)
            self._counts.update(
                (agent.agent, _action(rejection.text), rejection.reason) for rejection in agent.rejections
            )

    def total(self) -> list[CallCount]:
        """Return the counts, by agent and action."""
        return [CallCount(*place, count) for place, count in sorted(self._counts.items())]


def _action(words: str) -> str:
    found = _NAME.search(words)
    return found[1] if found else NAMELESS
