"""Spans for OpenTelemetry, from messages: one for each step, in it one for each agent, in that one for each model call.

Nothing in a match knows of them, so a turn costs the same with and without. Messages say how long things took, and
not when: a step ends when its report arrives, and its parts are laid out from there.
"""

from __future__ import annotations

import time
from collections import OrderedDict
from typing import TYPE_CHECKING, Any, NamedTuple

from opentelemetry import trace
from opentelemetry.sdk.resources import Resource
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.export import BatchSpanProcessor
from opentelemetry.trace import StatusCode

from khala_protocol.errors import ConfigError
from khala_protocol.messages import ModelCall, Report, count_refusals

if TYPE_CHECKING:
    from opentelemetry.context import Context
    from opentelemetry.sdk.trace import SpanProcessor

    from khala_protocol.messages import AgentReport, Wire
    from khala_sc2.service.book import Book

KEPT = 1000
"""Model calls that wait for the report of their step, of all matches; a prompt is not kept."""


class TracedDecision(NamedTuple):
    """What model calls and the report of a step have in common."""

    run: str
    side: str
    agent: str
    episode: int
    step: int


class TracedCall(NamedTuple):
    """A model call without its prompt."""

    began_s: float
    took_s: float
    attributes: dict[str, Any]
    failed: str


class Traces:
    """A `khala_sc2.service.daemon.MatchListener` that makes spans."""

    def __init__(self, processor: SpanProcessor) -> None:
        self._provider = TracerProvider(resource=Resource.create({"service.name": "khala"}))
        self._provider.add_span_processor(processor)
        self._tracer = self._provider.get_tracer("khala")
        self._calls: OrderedDict[TracedDecision, list[TracedCall]] = OrderedDict()

    def hear(self, message: Wire) -> None:
        """Keep a model call, or make the spans of a step."""
        match message:
            case ModelCall():
                self._keep(message)
            case Report():
                self._step(message, time.time_ns())

    def book(self, book: Book, used_mb: int) -> None:
        """Spans are of steps, not of matches that wait."""

    def close(self) -> None:
        """Send what is left."""
        self._provider.shutdown()

    def _keep(self, call: ModelCall) -> None:
        at = TracedDecision(call.run, call.side, call.agent, call.episode, call.step)
        usage = call.usage
        about: dict[str, Any] = {
            "gen_ai.operation.name": "chat",
            "gen_ai.request.model": call.model,
            "gen_ai.usage.input_tokens": usage.prompt_tokens,
            "gen_ai.usage.output_tokens": usage.completion_tokens,
            "server.address": call.endpoint,
            "khala.attempt": call.attempt,
        }
        failed = "" if call.status == "ok" else call.status
        self._calls.setdefault(at, []).append(TracedCall(call.started_s, call.latency_s, about, failed))
        while len(self._calls) > KEPT:
            self._calls.popitem(last=False)

    def _step(self, report: Report, end_ns: int) -> None:
        timings = report.timings
        after_s = timings.act_s + timings.game_s
        began_ns = end_ns - _ns(timings.observe_s + timings.publish_s + timings.wait_s + after_s)
        about: dict[str, Any] = {
            "khala_sc2.commands.run": report.run,
            "khala.side": report.side,
            "khala.episode": report.episode,
            "khala.step": report.step,
            "khala.game_loop": report.game_loop,
        }
        span = self._tracer.start_span("step", start_time=began_ns, attributes=about)
        inside = trace.set_span_in_context(span)
        for agent in report.agents:
            self._agent(report, agent, inside, end_ns - _ns(after_s))
        span.end(end_ns)

    def _agent(self, report: Report, agent: AgentReport, inside: Context, answered_ns: int) -> None:
        """Make the span of one decision, which may have been asked for in an earlier step."""
        asked = report.step if agent.asked_step is None else agent.asked_step
        calls = self._calls.pop(TracedDecision(report.run, agent.side, agent.agent, report.episode, asked), [])
        took_s = agent.latency_s or max((call.began_s + call.took_s for call in calls), default=0.0)
        began_ns = answered_ns - _ns(took_s)
        about: dict[str, Any] = {
            "khala_sc2.commands.run": report.run,
            "khala.agent": agent.agent,
            "khala.side": agent.side,
            "khala.step": asked,
            "khala.status": agent.status,
            "khala.accepted": len(agent.accepted),
            "khala.rejected": count_refusals(agent.rejections).total(),
        }
        span = self._tracer.start_span("agent", inside, start_time=began_ns, attributes=about)
        if agent.status != "ok":
            span.set_status(StatusCode.ERROR, agent.detail or agent.status)
        within = trace.set_span_in_context(span)
        for call in calls:
            start_ns = began_ns + _ns(call.began_s)
            child = self._tracer.start_span("model call", within, start_time=start_ns, attributes=call.attributes)
            if call.failed:
                child.set_status(StatusCode.ERROR, call.failed)
            child.end(start_ns + _ns(call.took_s))
        span.end(answered_ns)


def otlp(endpoint: str | None) -> SpanProcessor:
    """Return what sends spans to an endpoint; None: the one of the variables OTEL_EXPORTER_OTLP_….

    Raises:
        ConfigError: the exporter is not installed.
    """
    try:
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter  # noqa: PLC0415  # an extra
    except ImportError:
        raise ConfigError("traces need the exporter: pip install 'khala-sc2[otlp]'", source="--otlp") from None
    url = f"{endpoint.rstrip('/')}/v1/traces" if endpoint else None
    return BatchSpanProcessor(OTLPSpanExporter(endpoint=url))


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)
