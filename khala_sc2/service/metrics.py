"""What the service counts for Prometheus, from the messages of its matches and from its list of them.

A match is no label: a series for each would stay for ever. `khala matches` tells of single ones.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections import Counter as Count
from typing import TYPE_CHECKING, get_args

from aiohttp import web
from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, Counter, Gauge, Histogram, generate_latest

from khala_protocol.listening import Patience, bind
from khala_protocol.messages import Report, Result, count_refusals
from khala_protocol.service import MatchState
from khala_sc2.doors.pages import guard
from khala_sc2.doors.rules import Door

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from khala_protocol.messages import AgentReport, Wire
    from khala_sc2.service.book import Book

BUCKETS_S = (0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60)
"""Of a step, which waits for models: 0.2 s with the scripted one, at most `max_wait_s`, 15 by default, with others."""
MB = 2**20


class Metrics:
    """A `khala_sc2.service.daemon.MatchListener` with a registry of its own."""

    def __init__(self) -> None:
        self.registry = registry = CollectorRegistry()
        self._matches = Gauge(
            "khala_matches", "Matches by state, some of those that are over.", ["state"], registry=registry
        )
        self._episodes = Counter("khala_episodes", "Results of episodes.", ["outcome", "valid"], registry=registry)
        self._steps = Counter("khala_steps", "Steps of all matches.", registry=registry)
        self._step_s = Histogram("khala_step_seconds", "Wall time of a step.", buckets=BUCKETS_S, registry=registry)
        self._decisions = Counter("khala_decisions", "Decisions of agents by status.", ["status"], registry=registry)
        self._rejections = Counter("khala_rejections", "Calls that were not executed.", ["reason"], registry=registry)
        self._tokens = Counter("khala_tokens", "Tokens of models.", ["kind"], registry=registry)
        self._cost = Counter("khala_cost_usd", "Cost of models in US dollars, where known.", registry=registry)
        self._queue = Gauge("khala_queue_length", "Matches that wait.", registry=registry)
        self._rss = Gauge("khala_rss_bytes", "Memory of all processes of the service.", registry=registry)
        self._largest = Gauge("khala_match_rss_bytes", "Memory of the largest match.", registry=registry)

    @contextlib.asynccontextmanager
    async def serve(self, port: int, host: str = "127.0.0.1") -> AsyncIterator[int]:
        """Answer `GET /metrics` to programs of this machine, and yield the port.

        Raises:
            ConfigError: the port is taken.
        """
        application = web.Application(middlewares=[guard(Door(command="khala serve"))])
        application.router.add_get("/metrics", self._answer)
        runner = web.AppRunner(application, access_log=None, shutdown_timeout=1.0)
        await runner.setup()
        assert runner.server is not None
        try:
            with bind(host, port, option="--metrics") as listening:
                server = await asyncio.get_running_loop().create_server(Patience(runner.server), sock=listening)
                yield int(listening.getsockname()[1])
                server.close()
        finally:
            await runner.cleanup()

    async def _answer(self, _: web.Request) -> web.Response:
        return web.Response(body=generate_latest(self.registry), headers={"Content-Type": CONTENT_TYPE_LATEST})

    def hear(self, message: Wire) -> None:
        """Count a message of a match."""
        match message:
            case Report():
                timings = message.timings
                self._steps.inc()
                took_s = timings.observe_s + timings.publish_s + timings.wait_s + timings.act_s + timings.game_s
                self._step_s.observe(took_s)
                for agent in message.agents:
                    self._decision(agent)
            case Result():
                self._episodes.labels(message.outcome, str(message.valid).lower()).inc()

    def book(self, book: Book, used_mb: int) -> None:
        """Take the list of matches."""
        by_state = Count(card.state for card in book.matches().matches)
        for state in get_args(MatchState):
            self._matches.labels(state).set(by_state[state])
        self._queue.set(by_state["queued"])
        self._rss.set(used_mb * MB)
        self._largest.set(max((entry.card.rss_mb for entry in book.of("running")), default=0) * MB)

    def _decision(self, agent: AgentReport) -> None:
        self._decisions.labels(agent.status).inc()
        for reason, count in count_refusals(agent.rejections).items():
            self._rejections.labels(reason).inc(count)
        self._tokens.labels("prompt").inc(agent.usage.prompt_tokens)
        self._tokens.labels("completion").inc(agent.usage.completion_tokens)
        self._cost.inc(agent.usage.cost_usd or 0.0)
