"""Whether an episode says something about its agents: one function decides, from what each of them did.

An agent decides if its own model or policy does: an answer without a word, a refusal, a failure, a late reply and a
policy that stands in are decisions that it did not make (`khala_protocol.messages.AgentStatus`), and so is a question
that is open when the episode ends. One that only holds its fire, or gives orders that are not possible, decides; so
does a policy without a model that says nothing.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    from khala_bridge.state import Forfeit
    from khala_orchestrator.roster import Seat
    from khala_protocol.messages import AgentReport

AWAY: Final = "it went away"
"""Why an agent is lost that did not come back."""
ONE = 1
"""So many decisions an agent may always leave to others: a short episode is not lost by one late answer."""
NAMED_CAUSES = 3
"""Causes that a sentence names; the counts of the result have all."""
NO_MERIT: Final[dict[Forfeit | None, str]] = {
    "guest gone": "the guest's connection or process ended, so that nobody was beaten",
    "guest hung": "the guest did not go on, so that nobody was beaten",
}
"""Why a win over a guest that went away says nothing; one that gives up is beaten."""


@dataclass(slots=True)
class Deeds:
    """What the agents of a side did in an episode, by name."""

    statuses: dict[str, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))
    """How many decisions ended `ok`, `late`, …"""
    causes: dict[str, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))
    """Why the agent did not make those that are not `ok`."""
    accepted: Counter[str] = field(default_factory=Counter)
    """How many orders were carried out."""
    words: dict[str, str] = field(default_factory=dict)
    """What an endpoint or a policy first said of its failure."""

    def add(self, report: AgentReport) -> None:
        """Count a decision."""
        name = report.agent
        self.statuses[name][report.status] += 1
        self.accepted[name] += len(report.accepted)
        if report.status != "ok":
            self.causes[name][report.detail or report.status] += 1
            if report.reason:
                self.words.setdefault(name, report.reason)

    def missing(self, name: str) -> tuple[int, int]:
        """Return how many decisions an agent did not make, and how many it was asked for."""
        counts = self.statuses.get(name, Counter[str]())
        return counts.total() - counts["ok"], counts.total()


def why_not_valid(
    deeds: Deeds,
    required: Collection[str],
    *,
    limit: float,
    lost: Mapping[Seat, str],
    forfeit: Forfeit | None,
) -> str:
    """Return why an episode says nothing about its agents; "" if it does.

    Args:
        deeds: what they did.
        required: the agents that count; all that were asked if there are none.
        limit: the part of its decisions that an agent may leave to others or to nobody.
        lost: agents without which the match could not go on, of any side, and why.
        forfeit: how the game's other player gave the game away, if it did.
    """
    if lost:
        return "; ".join(_lost(lost))
    if forfeit in NO_MERIT:
        return NO_MERIT[forfeit]
    return "; ".join(_indecisions(deeds, required, limit))


def _lost(lost: Mapping[Seat, str]) -> Iterator[str]:
    if away := [str(seat) for seat, why in lost.items() if why == AWAY]:
        yield f"required agents went away: {', '.join(away)}"
    for seat, why in lost.items():
        if why != AWAY:
            yield f"the endpoint of {seat} will not answer it: {why}"


def _indecisions(deeds: Deeds, required: Collection[str], limit: float) -> Iterator[str]:
    for name in required or deeds.statuses:
        count, asked = deeds.missing(name)
        if not asked or (count < asked and count <= max(limit * asked, ONE)):
            continue
        causes = ", ".join(f"{number} {cause}" for cause, number in deeds.causes[name].most_common(NAMED_CAUSES))
        said = f", first: {deeds.words[name]}" if name in deeds.words else ""
        if count == asked:
            yield f"{name} never decided ({causes}{said})"
        else:
            part = f"{count / asked:.0%}, the limit is {limit:.0%}"
            yield f"{name} did not make {count} of {asked} decisions ({part}: {causes}{said})"
