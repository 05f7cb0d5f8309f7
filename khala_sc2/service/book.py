"""Which matches the service has, what became of them, and whose turn it is. It knows no process and no bus.

Matches of different owners take turns: the next one is of the owner with the fewest running, then of the one that has
waited longest for a turn, the oldest of these first. Owners name themselves, so those of whom no match was begun yet
count as one owner together: any number of new names gets one turn, and one part of the queue.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_protocol.service import MAX_WORDS, OPEN, MatchCard, Matches

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_orchestrator.config import MatchConfig
    from khala_protocol.messages import Report, Result
    from khala_protocol.service import MatchState, Submit
    from khala_sc2.playing.minds import Minds

KEPT = 100
"""Matches that are over and still listed, and as many that were refused."""
KNOWN_OWNERS = 1000
STRANGERS = ""
"""All owners of whom no match was begun yet."""
MAX_NAME = 64
"""Of the name of a match that is refused, perhaps for its name."""
USUAL_MB = 700
"""Memory of a match that has not shown that it takes more: host, game, endpoint and two processes of agents."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What the service may take."""

    matches: int = 2
    """At once."""
    memory_mb: int = 2**20
    """Of all processes of the service together."""
    queued: int = 100
    """Further ones are refused."""
    trusts: bool = False
    """Whether an order may name code and addresses, which this machine then runs and calls."""


@dataclass(slots=True)
class BookEntry:
    """One match."""

    card: MatchCard
    config: MatchConfig | None = None
    """None for one that was refused."""
    minds: Mapping[str, Minds] = field(default_factory=dict)
    """By side."""
    resume: bool = False
    """Whether it goes on with a recording, however often a worker began."""
    results: dict[tuple[int, str], str] = field(default_factory=dict)
    """Outcomes, by episode and side."""
    stop_because: str = ""
    """Set once it shall end."""

    def update(self, **changes: object) -> None:
        """Change what its card says."""
        self.card = self.card.but(**changes)


@dataclass(slots=True)
class Book:
    """The matches of the service, in the order in which they came."""

    limits: Limits = field(default_factory=Limits)
    draining: bool = False
    _entries: dict[str, BookEntry] = field(default_factory=dict)
    """By the number of the order."""
    _largest_mb: int = 0
    _turns: dict[str, int] = field(default_factory=dict)
    """By owner, the number of the last turn it had; the newest last."""
    _last_turn: int = 0

    def entry(self, run: str) -> BookEntry | None:
        """Return the newest match of this name that was taken."""
        return next((e for e in reversed(self._entries.values()) if e.card.run == run and e.config), None)

    def knows(self, number: str) -> bool:
        """Return whether this order came before."""
        return number in self._entries

    def why_not(self, run: str, owner: str) -> str:
        """Return why a match of this name is not taken now, as a sentence; empty if it is.

        An owner may have as many matches waiting as there are free places left. So one has half of the queue at most,
        and there is always a place for the first match of another.
        """
        if self.draining:
            return "the service is ending, and takes no more matches"
        waiting = self.of("queued")
        party = self._party(owner)
        if len(waiting) >= self.limits.queued:
            return f"{self.limits.queued} matches are waiting already: try again when some are over"
        if (mine := sum(self._party(entry.card.owner) == party for entry in waiting)) >= self.limits.queued - len(
            waiting
        ):
            whose = f"of {party}" if party else "of owners that this service has not played for yet"
            return (
                f"{mine} matches {whose} are waiting already, and the other places are kept for others: try again later"
            )
        if (entry := self.entry(run)) is not None and entry.card.state in OPEN:
            return f"a match called {run} is {entry.card.state} already: give another --run"
        return ""

    def add(self, order: Submit, config: MatchConfig, minds: Mapping[str, Minds]) -> BookEntry:
        """Take a match."""
        card = MatchCard(
            run=order.run,
            number=order.number,
            owner=order.owner,
            task=config.task.name,
            state="queued",
            episodes=config.episodes,
            recording=str(config.record.parent) if config.record else "",
        )
        return self._put(BookEntry(card, config, minds, order.resume))

    def refuse(self, order: Submit, reason: str) -> BookEntry:
        """Keep in mind why a match was not taken, for the one who asks."""
        card = MatchCard(run=order.run[:MAX_NAME], number=order.number, owner=order.owner, task="", state="refused")
        return self._put(BookEntry(card.but(reason=reason[:MAX_WORDS])))

    def next(self, used_mb: int) -> BookEntry | None:
        """Return the match to begin now, if one is waiting and there is room.

        Args:
            used_mb: memory that all processes of the service take.
        """
        waiting, running = self.of("queued"), self.of("running")
        if not waiting or len(running) >= self.limits.matches:
            return None
        if running and used_mb + max(self._largest_mb, USUAL_MB) > self.limits.memory_mb:
            return None
        busy = Counter(self._party(entry.card.owner) for entry in running)

        def place(entry: BookEntry) -> tuple[int, int]:
            party = self._party(entry.card.owner)
            return busy[party], self._turns.get(party, 0)

        return min(waiting, key=place)

    def begin(self, entry: BookEntry) -> None:
        """Note that a match is begun: its owner has had its turn, and is known from now on."""
        entry.update(state="running")
        self._last_turn += 1
        for party in {self._party(entry.card.owner), entry.card.owner}:
            self._turns.pop(party, None)
            self._turns[party] = self._last_turn
        while len(self._turns) > KNOWN_OWNERS:
            del self._turns[next(iter(self._turns))]

    def _party(self, owner: str) -> str:
        return owner if owner in self._turns else STRANGERS

    def note_memory(self, entry: BookEntry, rss_mb: int) -> None:
        """Take what a match takes in memory."""
        self._largest_mb = max(self._largest_mb, rss_mb)
        entry.update(rss_mb=rss_mb)

    def too_large(self, used_mb: int) -> BookEntry | None:
        """Return the match to end because all together take too much: the largest."""
        running = [entry for entry in self.of("running") if not entry.stop_because]
        if used_mb <= self.limits.memory_mb or not running:
            return None
        return max(running, key=lambda entry: entry.card.rss_mb)

    def report(self, report: Report) -> None:
        """Count a step of a match."""
        if (entry := self.entry(report.run)) is not None:
            costs = (agent.usage.cost_usd or 0.0 for agent in report.agents)
            cost_usd = entry.card.cost_usd + sum(costs)
            entry.update(episode=report.episode, step=report.step + 1, cost_usd=cost_usd)

    def result(self, result: Result) -> None:
        """Take the result of an episode, which a resumed match reports again."""
        if (entry := self.entry(result.run)) is not None:
            known = entry.results | {(result.episode, result.side): result.outcome}
            entry.results = known
            entry.update(outcomes=tuple(known[place] for place in sorted(known)))

    def close_match(self, entry: BookEntry, state: MatchState, reason: str = "") -> None:
        """Close a match; the oldest of those that are over are forgotten."""
        entry.update(state=state, reason=reason[:MAX_WORDS], rss_mb=0)
        refused = state == "refused"  # a flood of these must not push out what was played
        alike = [
            number
            for number, entry in self._entries.items()
            if entry.card.state not in OPEN and (entry.card.state == "refused") == refused
        ]
        for number in alike[: max(0, len(alike) - KEPT)]:
            del self._entries[number]

    def of(self, *states: MatchState) -> list[BookEntry]:
        """Return the matches in these states."""
        return [entry for entry in self._entries.values() if entry.card.state in states]

    def matches(self) -> Matches:
        """Return the list for all to read."""
        return Matches(matches=tuple(entry.card for entry in self._entries.values()), draining=self.draining)

    def _put(self, entry: BookEntry) -> BookEntry:
        self._entries[entry.card.number] = entry
        if entry.card.state not in OPEN:
            self.close_match(entry, entry.card.state, entry.card.reason)
        return entry
