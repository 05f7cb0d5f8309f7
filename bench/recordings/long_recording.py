"""A recording as long as wanted, made of a short one that was played.

A match of `simple64_sceb` with pictures is played for `STEPS` steps against the scripted model; then its steps are
written again and again, each time later in steps, game loops and wall time, until there are as many decisions as
asked for. So every message is one that Khala wrote, of the usual length; what a game would be like by then it does not
show. Flushed after every step, as a host does it.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from bench.survival.processes import Processes
from khala_protocol.keys import Topic
from khala_protocol.recording import Recorded, Recorder, Recording

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

TASK = "simple64_sceb"
STEPS = 150
PATIENCE_S = 600.0
_TIMED = frozenset({Topic.OBSERVATION, Topic.REPLY, Topic.MESSAGE, Topic.EXCHANGE, Topic.REPORT, Topic.SCENE})


def play_short(directory: Path, *, task: str = TASK, steps: int = STEPS) -> Path:
    """Play a match with pictures and requests to a model; return its recording."""
    directory.mkdir(parents=True, exist_ok=True)
    options = ("--run", "short", "--latency", "0", "--max-steps", str(steps), "--images", "paper")
    with Processes(directory) as processes:
        process = processes.start("short", "run", task, *options, "--out", str(directory))
        process.wait(PATIENCE_S)
    return directory / "short" / "recording.mcap"


def lengthen(short: Path, long: Path, decisions: int) -> int:
    """Write a recording of at least so many decisions; return how many it has."""
    before, steps, after = _part(Recording.open(short))
    span_loops, span_ns = _span(steps)
    done = lap = 0
    with Recorder(long) as recorder:
        for sample in before:
            recorder.write(sample.key, sample.payload, log_time_ns=sample.log_time_ns)
        while done < decisions:
            for samples in steps:
                for sample in samples:
                    payload = _later(sample, lap * len(steps), lap * span_loops)
                    recorder.write(sample.key, payload, log_time_ns=sample.log_time_ns + lap * span_ns)
                    done += _is(sample, Topic.REPLY)
                recorder.flush()
            lap += 1
        for sample in after:
            recorder.write(sample.key, sample.payload, log_time_ns=sample.log_time_ns + lap * span_ns)
    return done


def _part(recording: Recording) -> tuple[list[Recorded], list[list[Recorded]], list[Recorded]]:
    """Return the samples before the first step, those of each step, and those after the last one."""
    before: list[Recorded] = []
    after: list[Recorded] = []
    steps: dict[int, list[Recorded]] = {}
    step = -1
    for sample in recording:
        if sample.address is not None and sample.address.topic in _TIMED:
            step = max(step, json.loads(sample.payload)["step"])
        if step < 0:
            before.append(sample)
        elif _is(sample, Topic.RESULT):
            after.append(sample)
        else:
            steps.setdefault(step, []).append(sample)
    return before, list(steps.values()), after


def _span(steps: Sequence[Sequence[Recorded]]) -> tuple[int, int]:
    """Return how long the steps are, in game loops and in nanoseconds."""
    loops = [json.loads(sample.payload)["game_loop"] for step in steps for sample in step if _is(sample, Topic.REPORT)]
    return loops[-1] - loops[0] + (loops[-1] - loops[-2]), steps[-1][-1].log_time_ns - steps[0][0].log_time_ns


def _later(sample: Recorded, steps: int, loops: int) -> bytes:
    """Return a message as of some steps and game loops later."""
    if not steps or sample.address is None or sample.address.topic not in _TIMED:
        return sample.payload
    message: dict[str, Any] = json.loads(sample.payload)
    message["step"] += steps
    if "game_loop" in message:
        message["game_loop"] += loops
    for agent in message.get("agents", ()):
        if agent.get("asked_step") is not None:
            agent["asked_step"] += steps
    return json.dumps(message, separators=(",", ":")).encode()


def _is(sample: Recorded, topic: Topic) -> bool:
    return sample.address is not None and sample.address.topic is topic
