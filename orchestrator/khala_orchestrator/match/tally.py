"""Sum up an episode: reports and snapshots in, one `Result` out."""

from __future__ import annotations

import statistics
from collections import Counter, defaultdict
from typing import TYPE_CHECKING

from khala_bridge.state import Alliance
from khala_bridge.state.ground import land_of
from khala_orchestrator.match.validity import AWAY, Deeds, why_not_valid
from khala_protocol.messages import (
    LOOPS_PER_S,
    STEP_LIMIT,
    Casualties,
    EndState,
    Report,
    Result,
    Usage,
    count_hallucinations,
    count_refusals,
)

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from khala_bridge.state import Snapshot
    from khala_orchestrator.roster import Seat
    from khala_protocol.messages import Ending, HallucinationKind, Outcome, Variant

REFUSED = "model refused"
"""Why an episode was ended in which an endpoint refuses an agent for good."""
MAX_INCIDENTS = 100
"""Incidents that a result lists; the reports have all of them."""


class Tally:
    """The running account of one episode."""

    def __init__(
        self,
        snapshot: Snapshot,
        side: str = "blue",
        required: Collection[str] = (),
        *,
        opponent: str = "",
        undecided: float = 0.0,
        variant: Variant = "files",
    ) -> None:
        """Begin with the first snapshot of a side.

        Args:
            snapshot: of the side.
            side: its name.
            required: the agents that it cannot do without.
            opponent: who it plays against, in words.
            undecided: the part of its decisions that a required agent may leave to others or to nobody.
            variant: of the task.
        """
        self._side = side
        self._required = tuple(required)
        self._opponent = opponent
        self._limit = undecided
        self._variant: Variant = variant
        self._deeds = Deeds()
        self._first = self._last = snapshot
        self._alliance: dict[int, Alliance] = {}
        self._dead: Counter[Alliance] = Counter()
        self._usage: dict[str, Usage] = defaultdict(Usage)
        self._unasked: dict[str, Counter[str]] = defaultdict(Counter)
        self._rejections: Counter[str] = Counter()
        self._hallucinations: Counter[HallucinationKind] = Counter()
        self._fates: dict[str, Counter[str]] = defaultdict(Counter)
        self._latencies_s: list[float] = []
        self._ages_loops: list[float] = []
        self._rethinks = Counter[str]()
        self._humans = Counter[str]()
        self._incidents: list[str] = []
        self._advisers: Counter[str] = Counter()
        self._lag_s = 0.0
        self._steps = self._env_steps = 0
        self._note(snapshot)

    def add(self, report: Report, after: Snapshot) -> None:
        """Count one step, and the state of the game after it."""
        self._steps += 1
        self._env_steps += report.env_steps
        for agent in report.agents:
            name = agent.agent
            self._deeds.add(agent)
            self._usage[name] += agent.usage
            self._rejections.update(refusals := count_refusals(agent.rejections))
            if agent.status == "ok":
                self._hallucinations.update(count_hallucinations(refusals))
            if agent.rethinks:
                self._rethinks[name] += agent.rethinks
            if agent.human:
                self._humans[name] += agent.status == "ok"
            if agent.fate is not None:
                self._fates[name][agent.fate] += 1
            if agent.latency_s is not None:
                self._latencies_s.append(agent.latency_s)
                self._ages_loops.append(agent.age_loops)
        for name, why in report.unasked.items():
            self._unasked[name][why] += 1
        self._incidents += [f"step {report.step}: {incident}" for incident in report.incidents]
        self._advisers.update(report.advisers)
        self._lag_s = report.timings.lag_s
        self._note(after)

    def result(self, run: str, episode: int, *, wall_s: float, agents_lost: Mapping[Seat, str] | None = None) -> Result:
        """Return the account at the end of the episode.

        Args:
            run: name of the run.
            episode: its number, from 0.
            wall_s: wall time of the episode.
            agents_lost: required agents, of any side, that will not decide any more and so ended it, and why.
        """
        agents_lost = agents_lost or {}
        outcome, cause = self._ending(agents_lost)
        why_not = why_not_valid(
            self._deeds, self._required, limit=self._limit, lost=agents_lost, forfeit=self._last.forfeit
        )
        killed = Casualties(units=self._dead[Alliance.ENEMY], value=self._last.score.killed - self._first.score.killed)
        lost = Casualties(units=self._dead[Alliance.OWN], value=self._last.score.lost - self._first.score.lost)
        return Result(
            run=run,
            side=self._side,
            episode=episode,
            variant=self._variant,
            outcome=outcome,
            cause=cause,
            opponent=self._opponent,
            valid=not why_not,
            invalid_because=why_not,
            steps=self._steps,
            env_steps=self._env_steps,
            game_loop=self._last.game_loop,
            game_s=self._last.game_loop / LOOPS_PER_S,
            wall_s=wall_s,
            killed=killed,
            lost=lost,
            kd=killed.value / lost.value if lost.value else None,
            score=self._last.score.total,
            holdings=self._holdings(),
            usage=dict(self._usage),
            statuses={name: dict(count) for name, count in self._deeds.statuses.items()},
            unasked={name: dict(count) for name, count in self._unasked.items()},
            rejections=dict(self._rejections),
            hallucinations=dict(self._hallucinations),
            fates={name: dict(count) for name, count in self._fates.items()},
            accepted_of=dict(self._deeds.accepted),
            fallbacks={name: dict(count) for name, count in self._deeds.causes.items()},
            rethinks=dict(self._rethinks),
            humans=dict(self._humans),
            incidents=tuple(self._incidents[:MAX_INCIDENTS]),
            advisers=dict(self._advisers),
            age_p50_loops=_quantile(self._ages_loops, 0.5),
            age_p95_loops=_quantile(self._ages_loops, 0.95),
            lag_s=self._lag_s,
            accepted=self._deeds.accepted.total(),
            latency_p50_s=statistics.median(self._latencies_s) if self._latencies_s else None,
            latency_p95_s=_quantile(self._latencies_s, 0.95),
        )

    def _holdings(self) -> EndState | None:
        """Return what the side has at the end; None if it began without a base."""
        if not land_of(self._first).own_halls:
            return None
        player = self._last.player
        return EndState(
            workers=player.food_workers,
            bases=len(land_of(self._last).own_halls),
            army=player.army_count,
            supply_used=player.food_used,
            supply_cap=player.food_cap,
        )

    def _ending(self, lost: Mapping[Seat, str]) -> tuple[Ending, str]:
        if self._last.outcome is not None:
            died = self._last.outcome == "draw" and not self._last.own
            return self._last.outcome, self._last.forfeit or (BOTH_DEAD if died else CAUSES[self._last.outcome])
        if not lost:
            return "cut", STEP_LIMIT
        return "aborted", "agents gone" if AWAY in lost.values() else REFUSED

    def _note(self, snapshot: Snapshot) -> None:
        self._dead.update(self._alliance[tag] for tag in snapshot.dead if tag in self._alliance)
        self._alliance.update((unit.tag, unit.alliance) for unit in snapshot.units.values())
        self._last = snapshot


BOTH_DEAD = "both sides dead"
CAUSES: dict[Outcome, str] = {"win": "enemy defeated", "loss": "defeated", "draw": "time limit"}
"""What a result of the game means on maps that end by the death of one side or by a clock."""


def valid_together(results: Sequence[Result]) -> Sequence[Result]:
    """Return the results of all sides: a win over a side that never answered says nothing, either."""
    faults = {result.side: result.invalid_because for result in results if not result.valid}
    why = "; ".join(f"side {side}: {fault}" for side, fault in faults.items())
    return [r.but(valid=False, invalid_because=why) if faults and r.valid else r for r in results]


def _quantile(values: list[float], share: float) -> float | None:
    if not values:
        return None
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]
