"""What the service tells of its matches: metrics and spans. All of it comes from messages."""

from __future__ import annotations

from typing import TYPE_CHECKING

import httpx
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter
from prometheus_client import generate_latest

from khala_protocol.messages import AgentReport, AgentStatus, ModelCall, Rejection, Report, Timings, Usage
from khala_sc2.service.book import Book
from khala_sc2.service.metrics import Metrics
from khala_sc2.service.traces import KEPT, Traces

if TYPE_CHECKING:
    from opentelemetry.sdk.trace import ReadableSpan

USAGE = Usage(requests=1, prompt_tokens=100, completion_tokens=7, cost_usd=0.5)


def report(step: int = 3, status: AgentStatus = "ok") -> Report:
    rejection = Rejection(reason="dead_target", message="it is dead", text="<x>", start=0)
    agent = AgentReport(
        agent="Stalkers", side="blue", status=status, latency_s=1.0, rejections=(rejection,), usage=USAGE
    )
    timings = Timings(observe_s=0.1, publish_s=0.1, wait_s=1.0, act_s=0.1, game_s=0.2)
    return Report(run="first", episode=0, step=step, game_loop=9, agents=(agent,), timings=timings)


def call(step: int = 3, status: str = "ok") -> ModelCall:
    return ModelCall(
        run="first", agent="Stalkers", side="blue", episode=0, step=step, attempt=1, model="m", endpoint="http://e",
        prompt=(), completion="", status=status, started_s=0.25, latency_s=0.5, usage=USAGE,
    )  # fmt: skip


def test_metrics_count_steps_decisions_tokens_cost_and_rejections() -> None:
    metrics = Metrics()
    metrics.hear(report())
    metrics.hear(report(status="late"))
    metrics.book(Book(), 512)
    text = generate_latest(metrics.registry).decode()
    for line in (
        "khala_steps_total 2.0",
        'khala_step_seconds_bucket{le="1.0"} 0.0',
        'khala_step_seconds_bucket{le="2.0"} 2.0',
        'khala_decisions_total{status="late"} 1.0',
        'khala_tokens_total{kind="prompt"} 200.0',
        "khala_cost_usd_total 1.0",
        'khala_rejections_total{reason="dead_target"} 2.0',
        'khala_matches{state="running"} 0.0',
        "khala_rss_bytes 5.36870912e+08",
    ):
        assert line in text


def test_a_step_has_a_span_with_its_agents_and_their_model_calls() -> None:
    exporter = InMemorySpanExporter()
    traces = Traces(SimpleSpanProcessor(exporter))
    traces.hear(call(status="http 500"))
    traces.hear(call())
    traces.hear(report())
    traces.close()
    spans = exporter.get_finished_spans()
    failed, well, agent, step = spans
    assert [span.name for span in spans] == ["model call", "model call", "agent", "step"]
    assert failed.parent == well.parent == agent.get_span_context()
    assert agent.parent == step.get_span_context()
    assert failed.status.description == "http 500"
    assert well.status.is_ok
    assert seconds(step) == 1.5
    assert seconds(agent) == 1.0
    assert seconds(well) == 0.5
    assert times(well)[0] - times(agent)[0] == 250_000_000
    (step_begins, step_ends), (agent_begins, agent_ends) = times(step), times(agent)
    assert step_begins <= agent_begins <= agent_ends <= step_ends
    assert dict(step.attributes or {})["khala.step"] == 3


def test_model_calls_without_a_report_are_forgotten_in_the_end() -> None:
    traces = Traces(SimpleSpanProcessor(InMemorySpanExporter()))
    for step in range(KEPT + 5):
        traces.hear(call(step))
    assert len(traces._calls) == KEPT


def times(span: ReadableSpan) -> tuple[int, int]:
    assert span.start_time is not None
    assert span.end_time is not None
    return span.start_time, span.end_time


def seconds(span: ReadableSpan) -> float:
    begins, ends = times(span)
    return (ends - begins) / 1e9


async def test_metrics_are_for_programs_of_this_machine() -> None:
    metrics = Metrics()
    metrics.hear(report())
    async with metrics.serve(0) as port, httpx.AsyncClient(base_url=f"http://127.0.0.1:{port}") as client:
        answer = await client.get("/metrics")
        assert (answer.status_code, "khala_steps_total 1.0" in answer.text) == (200, True)
        assert answer.headers["Content-Type"].startswith("text/plain; version=")
        for headers in (
            {"Host": "evil.example"},
            {"Origin": "http://evil.example"},
            {"Origin": "http://localhost:9"},
            {"Sec-Fetch-Site": "cross-site"},
        ):
            assert (await client.get("/metrics", headers=headers)).status_code == 403
        assert (await client.post("/metrics", content=b"x" * 100_000)).status_code == 413
        assert (await client.get("/")).status_code == 404
