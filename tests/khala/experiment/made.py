"""Matches that nobody played: a recording with a run card, a step, what its models cost, and a result."""

from __future__ import annotations

import asyncio
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Self

from khala_bridge.game.game import GameIdentity
from khala_orchestrator.match.cards import run_card
from khala_protocol.codec import encode
from khala_protocol.keys import Topic, agent_key, run_key
from khala_protocol.messages import AgentReport, Casualties, ModelCall, Report, Result, Usage
from khala_protocol.messages.to_all import STEP_LIMIT
from khala_protocol.recording import Recorder
from khala_sc2.playing.jobs import Ended

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from khala_orchestrator.config import MatchConfig
    from khala_sc2.playing.jobs import Job


GAME = GameIdentity("4.10", "B0", "Map.SC2Map", "0" * 64)


def record(path: Path, config: MatchConfig, *, cost_usd: float = 0.0, result: bool = True, won: bool = True,
           spent_out: bool = False, valid: bool = True, refused: bool = False, cut: bool = False) -> None:  # fmt: skip
    """Write the recording of a match of one step; without a result, as a runner that was killed leaves it."""
    run, agent = config.run, config.task.agents[0].name
    usage = Usage(requests=1, prompt_tokens=900, completion_tokens=100, cost_usd=cost_usd)
    call = ModelCall(
        run=run, agent=agent, side="blue", episode=0, step=0, attempt=1, model="m", endpoint="http://e", prompt=(),
        completion="", status="ok", started_s=0, latency_s=0, usage=usage,
    )  # fmt: skip
    status, detail = ("failed", "budget") if spent_out else ("ok", "")
    done = AgentReport(agent=agent, side="blue", status=status, detail=detail, usage=usage)
    report = Report(run=run, episode=0, step=0, game_loop=8, agents=(done,))
    value = Casualties(units=1, value=100.0)
    why = "the endpoint of blue/A will not answer it: there is no model 'x'" if refused else "A never decided"
    cause = STEP_LIMIT if cut else "model refused" if refused else "enemy defeated"
    ended = Result(
        run=run, episode=0, outcome="cut" if cut else "win" if won else "loss", cause=cause, steps=1, game_loop=8,
        game_s=0.4, wall_s=2.0, killed=value, lost=value, kd=1.0, valid=valid, invalid_because="" if valid else why,
    )  # fmt: skip
    with Recorder(path) as recorder:
        recorder.write(run_key(run, Topic.RUN), encode(run_card(config, GAME)))
        recorder.write(agent_key(run, "blue", agent, Topic.EXCHANGE), encode(call))
        recorder.write(run_key(run, Topic.REPORT), encode(report))
        if result:
            recorder.write(run_key(run, Topic.RESULT), encode(ended))


@dataclass
class MadeEngine:
    """An engine whose matches take a moment each, and end as it is told."""

    slots: int = 2
    ends: Callable[[Job, int], str] = lambda _job, _try: "done"
    """From a job and the number of its try: `done`, `lost`, `invalid`, `refused`, `spent`, `cut`, or `nothing`, which
    leaves no recording."""
    cost_usd: Callable[[Job], float] = lambda _: 0.0
    jobs: list[Job] = field(default_factory=list)
    most_at_once: int = 0
    _now: int = 0
    _tries: Counter[str] = field(default_factory=Counter)

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *error: object) -> None:
        pass

    async def play(self, job: Job) -> Ended:
        key = job.config.labels["match"]
        self._tries[key] += 1
        how = self.ends(job, self._tries[key])
        self.jobs.append(job)
        self._now += 1
        self.most_at_once = max(self.most_at_once, self._now)
        for _ in range(self.slots):
            await asyncio.sleep(0)
        self._now -= 1
        if how == "nothing":
            return Ended(state="lost", words="killed")
        assert job.config.record is not None
        left_usd = job.minds["blue"].budget_usd
        cost = self.cost_usd(job) if left_usd is None else min(self.cost_usd(job), left_usd)
        spent_out = how == "spent" or (left_usd is not None and cost < self.cost_usd(job))
        record(job.config.record, job.config, cost_usd=cost, result=how != "lost", spent_out=spent_out,
               won=job.config.seed % 2 == 0, valid=how not in {"invalid", "refused"},
               refused=how == "refused", cut=how == "cut")  # fmt: skip
        return Ended(state="lost", words="killed") if how == "lost" else Ended(state="done")
