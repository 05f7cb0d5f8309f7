"""Measure how fast a recording becomes numbers, beside reading it and doing nothing with it.

    python -m bench.measures                       a made-up recording: 8 agents and a model, as in bench.recording
    python -m bench.measures runs/*/recording.mcap
    python -m bench.measures --json

MB/s are those of the file, which is compressed; `payload_mb` is what was in it.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

from bench.recordings.recording import step_samples
from khala.experiment.measures import measure
from khala_protocol.codec import encode
from khala_protocol.keys import Topic, run_key
from khala_protocol.messages import Clock, Run
from khala_protocol.recording import Recorder, Recording, read

if TYPE_CHECKING:
    from collections.abc import Callable

TIMES = 3
"""Each is done so often, and the fastest counts."""


def make(path: Path, steps: int) -> Path:
    """Write a recording of 8 agents that ask a model at each step."""
    card = Run(
        run="bench", task="bench", map_name="", map_sha256="", seed=1, episodes=1, game="", executor="raw",
        clock=Clock(), agents=(), catalogue_sha256="", versions={},
    )  # fmt: skip
    with Recorder(path) as recorder:
        recorder.write(run_key("bench", Topic.RUN), encode(card))
        for step in range(steps):
            for key, payload in step_samples(step):
                recorder.write(key, payload)
            recorder.flush()
    return path


def figures(path: Path) -> dict[str, object]:
    """Return the sizes of a recording, and the times of reading and of measuring it."""
    recording = Recording.open(path)
    size_mb = path.stat().st_size / 1e6
    read_s = fastest(lambda: sum(1 for _ in read(path)))
    measure_s = fastest(lambda: measure(recording))
    return {
        "recording": str(path),
        "file_mb": round(size_mb, 2),
        "payload_mb": round(sum(len(sample.payload) for sample in recording) / 1e6, 1),
        "samples": recording.samples,
        "read_mb_s": round(size_mb / read_s, 1),
        "measure_mb_s": round(size_mb / measure_s, 1),
        "measure_us_per_sample": round(measure_s / recording.samples * 1e6),
    }


def fastest(work: Callable[[], object]) -> float:
    """Return the seconds of the fastest try."""
    took_s = []
    for _ in range(TIMES):
        begin = time.perf_counter()
        work()
        took_s.append(time.perf_counter() - begin)
    return min(took_s)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", nargs="*", type=Path)
    parser.add_argument("--steps", type=int, default=100, help="of the made-up recording")
    parser.add_argument("--json", action="store_true", help="one JSON array instead of lines")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        paths = options.recordings or [make(Path(directory) / "bench.mcap", options.steps)]
        rows = [figures(path) for path in paths]
    if options.json:
        print(json.dumps(rows))
        return
    for row in rows:
        print("\n".join(f"{name:24} {value}" for name, value in row.items()), end="\n\n")


if __name__ == "__main__":
    main()
