"""Plays the matches of an experiment that are missing: pilot, budget, retries.

Each match may spend at most a part of what is left, so that all together never spend more than the budget: what a
match that runs may still spend is held back from the others. While nobody knows what a match costs, one is played
alone. What it has spent stands in its ledger, whatever became of it and of its recording. A match that ends because its
part is used up counts as invalid, with the cause `budget`. Matches of models whose endpoint refuses them for good are
not begun any more. Below it an engine plays, and the store keeps what was played.
"""

from __future__ import annotations

import asyncio
import statistics
import time
from collections import Counter, deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol

from khala_orchestrator.match.tally import REFUSED
from khala_sc2.experiment.played import unread
from khala_sc2.playing.jobs import Job
from khala_sc2.playing.minds import share_budget

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from khala_sc2.experiment.engine import Engine
    from khala_sc2.experiment.plan import PlannedMatch
    from khala_sc2.experiment.played import PlayedMatch
    from khala_sc2.experiment.spec import ExperimentBudget
    from khala_sc2.experiment.store import Store
    from khala_sc2.playing.jobs import Ended

LEAST_USD = 1e-6
"""Smaller sums are ignored: floating-point money is not exact."""
SPARE = 1.2
"""A match is begun with so many times what is usual: its last requests are held at the most that they may cost."""
ROOM = 2.0
"""A match may spend this many times what the dearest one of its cell has cost."""
FIRST = 0.1
"""The first match of a cell may spend this part of what is left, if that is more: what others cost says little."""
_CRASHES = {"lost": "crash", "stopped": "crash", "error": "crash", "timeout": "timeout"}


@dataclass(frozen=True, slots=True)
class RunnerEvent:
    """What happens with one match."""

    what: Literal["begins", "ends", "again"]
    """`again`: it crashed, and is played once more."""
    match: PlannedMatch
    played: PlayedMatch | None = None
    words: str = ""


@dataclass(frozen=True, slots=True)
class CostEstimate:
    """What the matches that are missing will take, from those that were played."""

    matches: int
    usd: float | None
    """None if no price is known."""
    tokens: float
    hours: float
    """Of wall time, with all slots at work."""


@dataclass(slots=True)
class Spent:
    """What was spent, and what matches that run may still spend."""

    usd: float = 0.0
    tokens: int = 0
    held_usd: float = 0.0


class PlayRules(Protocol):
    """What an experiment or an arena says of single matches."""

    @property
    def retries(self) -> int:
        """How often a match that crashed is played again."""

    @property
    def match_hours(self) -> float:
        """After so long a match is ended, and counts as crashed."""


@dataclass(slots=True)
class Runner:
    """Plays the matches of one experiment or arena."""

    experiment: PlayRules
    store: Store
    engine: Engine
    budget: ExperimentBudget
    see: Callable[[RunnerEvent], None] = lambda _: None
    processes: bool = False
    """Whether agents get processes of their own."""
    spent: Spent = field(default_factory=Spent)
    stopped: str = ""
    """Why matches were not begun; "" if all were."""
    _began_s: float = 0.0
    _next_end: asyncio.Event = field(default_factory=asyncio.Event)
    """Is set when a match ends."""
    _played: dict[str, PlayedMatch] = field(default_factory=dict)
    _waiting: deque[PlannedMatch] = field(default_factory=deque)
    _tries: Counter[str] = field(default_factory=Counter)
    _unread_usd: dict[str, float] = field(default_factory=dict)
    """By match, what is in its ledgers and not in the index: its recording could not be read."""
    _refused: dict[str, str] = field(default_factory=dict)
    """By the models of a match, why an endpoint will answer none of its agents."""
    _short_usd: dict[str, float] = field(default_factory=dict)
    """By cell, the most that was not enough for one of its matches."""

    def __post_init__(self) -> None:
        """Count what was spent before, also by a runner that was killed."""
        self.store.adopt()
        self._played = self.store.matches()
        self._unread_usd = self.store.booked_usd()
        for played in self._played.values():
            self._count(played)
            self._unread_usd[played.key] = max(self._unread_usd.get(played.key, 0.0) - (played.cost_usd or 0.0), 0.0)
        self.spent.usd += sum(self._unread_usd.values())
        for played in self._played.values():
            if played.cause == "budget":
                self._was_short(played.cell, played.cost_usd or 0.0)

    async def play(self, matches: Sequence[PlannedMatch]) -> None:
        """Play those of the matches that are missing, several at a time."""
        self._began_s = self._began_s or time.monotonic()
        self._waiting = deque(missing(matches, self._played))
        async with asyncio.TaskGroup() as group:
            for _ in range(min(self.engine.slots, len(self._waiting))):
                group.create_task(self._slot())

    async def _slot(self) -> None:
        while self._waiting:
            match = self._waiting.popleft()
            if why := self._refused.get(_minds_of(match)):
                self.stopped = why
            elif self.spent.held_usd > LEAST_USD and (self._too_dear(match) or self._costs_nobody_knows_what(match)):
                self._waiting.appendleft(match)  # one that runs will give back what it does not spend
                await self._next_end.wait()
            elif why := self._used_up() or self._too_many_tokens(match) or self._too_dear(match):
                self.stopped = why
                return
            else:
                await self._play(match)

    async def _play(self, match: PlannedMatch) -> None:
        part_usd = self._part_usd(match)
        self.spent.held_usd += part_usd or 0.0
        self._tries[match.key] += 1
        record = self.store.recording_for(match.key)
        self.see(RunnerEvent("begins", match))
        minds = match.minds if part_usd is None else share_budget(match.minds, part_usd)
        job = Job(
            config=match.config.model_copy(update={"record": record}),
            minds=minds,
            timeout_s=3600 * self.experiment.match_hours,
            processes=self.processes,
        )
        ended = await self.engine.play(job)
        tries = self._tries[match.key]
        crash = _CRASHES.get(ended.state, "")
        found = await asyncio.to_thread(self.store.read, record, attempts=tries, crash=crash)
        if found is None:
            cost_usd = (await asyncio.to_thread(self.store.booked_usd)).get(match.key)
            found = unread(match, tries, crash or "crash", cost_usd), []
        self.store.add(*found)
        if any(row.cause == REFUSED for row, _ in found[1]):
            self._refused[_minds_of(match)] = self.stopped = found[0].cause
        self.spent.held_usd -= part_usd or 0.0
        if found[0].cause == "budget" and part_usd is not None:
            self._was_short(match.cell, part_usd)
        self._end(match, ended, found[0])
        self._next_end.set()
        self._next_end = asyncio.Event()

    def _end(self, match: PlannedMatch, ended: Ended, played: PlayedMatch) -> None:
        self.spent.usd -= self._unread_usd.pop(match.key, 0.0)
        if before := self._played.get(match.key):
            self._count(before, -1)  # what its tries have cost together is in the new account
        self._count(played)
        self._played[match.key] = played
        if played.state == "crashed" and self._tries[match.key] <= self.experiment.retries:
            self._waiting.append(match)
            self.see(RunnerEvent("again", match, played, ended.words))
        else:
            self.see(RunnerEvent("ends", match, played, ended.words))

    def _count(self, played: PlayedMatch, sign: int = 1) -> None:
        self.spent.usd += sign * (played.cost_usd or 0.0)
        self.spent.tokens += sign * (played.tokens or 0)

    # --- what it takes --------------------------------------------------------------------------------

    def _used_up(self) -> str:
        """Return why no match is begun any more; "" if there is time."""
        hours = (time.monotonic() - self._began_s) / 3600
        if self.budget.hours is not None and hours >= self.budget.hours:
            return f"the budget of {self.budget.hours:g} hours is used up"
        return ""

    def _too_many_tokens(self, match: PlannedMatch) -> str:
        """Return why a match would read and write too much; "" if it would not."""
        tokens = _mean(self._numbers(match, "tokens")) or 0.0
        if self.budget.tokens is not None and self.spent.tokens + tokens > self.budget.tokens:
            return f"the budget of {self.budget.tokens} tokens is used up ({self.spent.tokens} were read and written)"
        return ""

    def _too_dear(self, match: PlannedMatch) -> str:
        """Return why there is too little money for a match; "" if there is enough."""
        usual_usd = _mean(self._numbers(match, "cost_usd")) or 0.0
        left = self._left_usd()
        short = self._short_usd.get(str(match.cell))
        if left is not None and (left < LEAST_USD or left < SPARE * usual_usd):
            return f"the budget of {self.budget.usd:g} USD is used up ({self.spent.usd:.4f} were spent)"
        if left is not None and short is not None and left <= short:
            return f"{left:.4f} USD are left, and {short:.4f} were not enough for {', '.join(match.cell.values())}"
        return ""

    def _costs_nobody_knows_what(self, match: PlannedMatch) -> bool:
        """Return whether no match was played that says what this one may cost: the first one is played alone."""
        return self._part_usd(match) is not None and not (
            self._numbers(match, "cost_usd") or str(match.cell) in self._short_usd
        )

    def _was_short(self, cell: dict[str, str], usd: float) -> None:
        """Note that so much money was not enough for a match of a cell."""
        self._short_usd[str(cell)] = max(usd, self._short_usd.get(str(cell), 0.0))

    def _left_usd(self) -> float | None:
        if self.budget.usd is None:
            return None
        return self.budget.usd - self.spent.usd - self.spent.held_usd

    def _part_usd(self, match: PlannedMatch) -> float | None:
        """Return what a match may spend: what is usual with some room, all while nothing is known; None for any sum."""
        left = self._left_usd()
        if left is None or not any(mind.asks_a_model for mind in match.minds.values()):
            return None
        costs = self._numbers(match, "cost_usd")
        short = self._short_usd.get(str(match.cell), 0.0)
        if wanted := ROOM * max(*costs, short, 0.0):
            is_first = not short and all(played.cell != match.cell for played in self._played.values())
            return min(left, max(wanted, FIRST * left) if is_first else wanted)
        return left / max(1, min(self.engine.slots, len(self._waiting) + 1)) if costs else left

    def _numbers(self, match: PlannedMatch, name: str) -> list[float]:
        """Return what matches of the same cell have taken; of all if none of them was played."""
        return numbers_of(self._played.values(), match.cell, name)

    @property
    def knows_anything(self) -> bool:
        """Whether a match was played from which others can be estimated."""
        return any(played.state == "done" for played in self._played.values())

    def estimate(self, matches: Sequence[PlannedMatch]) -> CostEstimate:
        """Return what those of the matches that are missing will take."""
        left = list(missing(matches, self._played))
        sums = dict.fromkeys(("cost_usd", "tokens", "wall_s"), 0.0)
        for match in left:
            for name in sums:
                sums[name] += _mean(self._numbers(match, name)) or 0.0
        priced = any(played.cost_usd is not None for played in self._played.values())
        hours = sums["wall_s"] / 3600 / max(1, min(self.engine.slots, len(left)))
        return CostEstimate(len(left), sums["cost_usd"] if priced else None, sums["tokens"], hours)


def _minds_of(match: PlannedMatch) -> str:
    return repr(match.minds)


def numbers_of(played: Iterable[PlayedMatch], cell: dict[str, str], name: str) -> list[float]:
    """Return a number of the matches of a cell, of all if none of them was played."""
    known = [match for match in played if match.state == "done" and getattr(match, name) is not None]
    same = [match for match in known if match.cell == cell]
    return [getattr(match, name) for match in same or known]


def missing(matches: Iterable[PlannedMatch], played: dict[str, PlayedMatch]) -> Iterable[PlannedMatch]:
    """Return the matches that were not played, or whose match did not end as it should."""
    return (match for match in matches if match.key not in played or played[match.key].state != "done")


def pilot_of(matches: Sequence[PlannedMatch], count: int) -> list[PlannedMatch]:
    """Return the first matches of each cell."""
    seen: Counter[str] = Counter()
    chosen = []
    for match in matches:
        place = str(match.cell)
        seen[place] += 1
        if seen[place] <= count:
            chosen.append(match)
    return chosen


def _mean(numbers: list[float]) -> float | None:
    return statistics.fmean(numbers) if numbers else None
