"""Sum up an episode: reports and snapshots in, one `Result` out."""

from __future__ import annotations

import statistics
from collections import Counter, defaultdict
from typing import TYPE_CHECKING

from khala_bridge.state import Alliance
from khala_protocol.messages import LOOPS_PER_S, Casualties, Report, Result, Usage

if TYPE_CHECKING:
    from khala_bridge.state import Snapshot
    from khala_protocol.messages import Outcome


class Tally:
    """The running account of one episode."""

    def __init__(self, snapshot: Snapshot) -> None:
        self._first = self._last = snapshot
        self._alliance: dict[int, Alliance] = {}
        self._dead: Counter[Alliance] = Counter()
        self._usage: dict[str, Usage] = defaultdict(Usage)
        self._statuses: dict[str, Counter[str]] = defaultdict(Counter)
        self._rejections: Counter[str] = Counter()
        self._latencies_s: list[float] = []
        self._accepted = 0
        self._steps = self._env_steps = 0
        self._note(snapshot)

    def add(self, report: Report, after: Snapshot) -> None:
        """Count one step, and the state of the game after it."""
        self._steps += 1
        self._env_steps += report.env_steps
        for agent in report.agents:
            name = agent.agent
            self._usage[name] += agent.usage
            self._statuses[name][agent.status] += 1
            self._rejections.update(rejection.reason for rejection in agent.rejections)
            self._accepted += len(agent.accepted)
            if agent.latency_s is not None:
                self._latencies_s.append(agent.latency_s)
        self._note(after)

    def result(self, run: str, episode: int, *, wall_s: float) -> Result:
        """Return the account at the end of the episode.

        Args:
            run: name of the run.
            episode: its number, from 0.
            wall_s: wall time of the episode.
        """
        outcome = self._last.outcome or "draw"
        cause = CAUSES[outcome] if self._last.outcome else "step limit"
        killed = Casualties(units=self._dead[Alliance.ENEMY], value=self._last.score.killed - self._first.score.killed)
        lost = Casualties(units=self._dead[Alliance.OWN], value=self._last.score.lost - self._first.score.lost)
        return Result(
            run=run,
            episode=episode,
            outcome=outcome,
            cause=cause,
            steps=self._steps,
            env_steps=self._env_steps,
            game_loop=self._last.game_loop,
            game_s=self._last.game_loop / LOOPS_PER_S,
            wall_s=wall_s,
            killed=killed,
            lost=lost,
            kd=killed.value / lost.value if lost.value else None,
            score=self._last.score.total,
            usage=dict(self._usage),
            statuses={name: dict(count) for name, count in self._statuses.items()},
            rejections=dict(self._rejections),
            accepted=self._accepted,
            latency_p50_s=statistics.median(self._latencies_s) if self._latencies_s else None,
            latency_p95_s=_quantile(self._latencies_s, 0.95),
        )

    def _note(self, snapshot: Snapshot) -> None:
        self._dead.update(self._alliance[tag] for tag in snapshot.dead if tag in self._alliance)
        self._alliance.update((unit.tag, unit.alliance) for unit in snapshot.units.values())
        self._last = snapshot


CAUSES: dict[Outcome, str] = {"win": "enemy defeated", "loss": "defeated", "draw": "time limit"}
"""What a result of the game means on maps that end by the death of one side or by a clock."""


def _quantile(values: list[float], share: float) -> float | None:
    if not values:
        return None
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]
