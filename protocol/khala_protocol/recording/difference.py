"""The first point where a replay differs from its recording: one value, with a text that names the place.

The replays are above (`khala_orchestrator.past.replay`, `khala_agents.replay`); they compare bytes or words as sent.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Difference:
    """A sent value that differs from the recorded one.

    Attributes:
        agent: the agent of the observation, reply or message.
        what: `observation`, `reply`, `messages`.
        recorded: as it stands in the recording.
        sent: as it was sent now; empty if it was not sent at all.
    """

    agent: str
    episode: int
    step: int
    what: str
    recorded: str
    sent: str

    def __str__(self) -> str:
        at = next((i for i, (a, b) in enumerate(zip(self.recorded, self.sent, strict=False)) if a != b), None)
        start = max(0, (min(len(self.recorded), len(self.sent)) if at is None else at) - 40)
        return (
            f"{self.what} of {self.agent} in episode {self.episode}, step {self.step}: "
            f"recorded …{self.recorded[start : start + 100]!r}, sent …{self.sent[start : start + 100]!r}"
        )
