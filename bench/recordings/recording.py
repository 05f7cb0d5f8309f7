"""Write and read a recording of a match of eight agents, and measure the cost.

    python bench/recordings/recording.py            a table
    python bench/recordings/recording.py --json     one JSON object on stdout

A step is the traffic of an agent's turn, times eight: an observation (about 20 kB of text, 40 kB with its
view), an exchange with the model (the same text again, and the completion), a reply; then one report and a
flush. The texts are words drawn again for each step, which zstd compresses about as well as real observations;
views repeat their field names and compress better.
"""

from __future__ import annotations

import argparse
import json
import random
import statistics
import tempfile
import time
from pathlib import Path

from khala_protocol.codec import encode
from khala_protocol.keys import Topic, agent_key, run_key
from khala_protocol.messages import ChatMessage, ModelCall, Observation, Reply, Report, TeamView, UnitView, View
from khala_protocol.recording import Recorder, read

AGENTS = 8
TEXT_BYTES = 20_000
UNITS = 60


def units(chance: random.Random) -> tuple[UnitView, ...]:
    return tuple(
        UnitView(
            tag=hex(chance.getrandbits(33)),
            type="Stalker",
            alliance="own",
            screen=(round(chance.uniform(0, 24), 2), round(chance.uniform(0, 24), 2)),
            minimap=(round(chance.uniform(0, 64), 2), round(chance.uniform(0, 64), 2)),
            health=chance.randrange(80),
            health_max=80,
            shield=chance.randrange(80),
            shield_max=80,
        )
        for _ in range(UNITS)
    )


def step_samples(step: int) -> list[tuple[str, bytes]]:
    chance = random.Random(step)
    samples = []
    for number in range(AGENTS):
        agent = f"CombatGroup{number}"
        text = " ".join(hex(chance.getrandbits(20)) for _ in range(TEXT_BYTES // 8))
        where = {"run": "bench", "agent": agent, "side": "p1", "episode": 0, "step": step}
        team = TeamView(name="Stalker-1", minimap=(1.0, 2.0), units=units(chance))
        observation = Observation.model_validate(
            where | {"game_loop": step * 8, "answer_within_s": 15.0, "text": text}
            | {"view": View(time_s=step / 2.8, teams=(team,))}
        )  # fmt: skip
        exchange = ModelCall.model_validate(
            where | {"attempt": 1, "model": "m", "endpoint": "http://localhost", "status": "ok", "started_s": 0.1}
            | {"prompt": (ChatMessage(role="user", content=text),), "completion": text[:1_400], "latency_s": 1.0}
        )  # fmt: skip
        reply = Reply.model_validate(where | {"text": text[:1_400]})
        for topic, message in ((Topic.OBSERVATION, observation), (Topic.EXCHANGE, exchange), (Topic.REPLY, reply)):
            samples.append((agent_key("bench", "p1", agent, topic), encode(message)))
    report = Report(run="bench", episode=0, step=step, game_loop=step * 8, agents=())
    return [*samples, (run_key("bench", Topic.REPORT), encode(report))]


def quantiles(values: list[float]) -> dict[str, float]:
    cuts = statistics.quantiles(values, n=100)
    return {"p50": round(cuts[49], 3), "p99": round(cuts[98], 3)}


def measure(steps: int, path: Path) -> dict[str, object]:
    content = [step_samples(step) for step in range(min(steps, 50))]
    messages = steps * len(content[0])
    size = sum(len(payload) for step in range(steps) for _, payload in content[step % len(content)])
    write_us: list[float] = []
    flush_ms: list[float] = []
    begin = time.perf_counter()
    with Recorder(path) as recorder:
        for step in range(steps):
            before = time.perf_counter()
            for key, payload in content[step % len(content)]:
                recorder.write(key, payload)
                after = time.perf_counter()
                write_us.append((after - before) * 1e6)
                before = after
            recorder.flush()
            flush_ms.append((time.perf_counter() - before) * 1e3)
    write_s = time.perf_counter() - begin
    begin = time.perf_counter()
    assert sum(len(sample.payload) for sample in read(path)) == size
    read_s = time.perf_counter() - begin
    begin = time.perf_counter()
    assert all(sample.message is not None for sample in read(path))
    decode_s = time.perf_counter() - begin
    return {
        "messages": messages,
        "payload_mb": round(size / 1e6, 1),
        "file_mb": round(path.stat().st_size / 1e6, 1),
        "write_mb_s": round(size / 1e6 / write_s, 1),
        "write_us_per_message": round(write_s / messages * 1e6, 1),
        "write_us": quantiles(write_us),
        "flush_ms_per_step": quantiles(flush_ms),
        "read_mb_s": round(size / 1e6 / read_s, 1),
        "read_us_per_message": round(read_s / messages * 1e6, 1),
        "read_and_decode_us_per_message": round(decode_s / messages * 1e6, 1),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=300)
    parser.add_argument("--json", action="store_true", help="one JSON object instead of a table")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        figures = measure(options.steps, Path(directory) / "bench.mcap")
    if options.json:
        print(json.dumps(figures))
        return
    for name, value in figures.items():
        print(f"{name:32} {value}")


if __name__ == "__main__":
    main()
