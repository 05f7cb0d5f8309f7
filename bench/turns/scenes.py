"""Measure what the map for those who watch costs a step: no scene, what the sides see, the whole map.

    python -m bench scenes                            2s3z, and a whole game
    python -m bench scenes simple64_sceb --steps 600
    python -m bench scenes --think 0.05               agents that take 50 ms, during which a scene is made

The steps of one match take turns, so that all three are measured on the same armies and with the same load of the
machine. Host, texts and game are those of a match, scenes are encoded and recorded; there is no bus. The agents answer
in this process; how long `skilled` decides is not counted, only what they are said to think. Times are means.
"""

from __future__ import annotations

import asyncio
import json
import logging
import random
import statistics
import sys
import tempfile
import time
from collections import defaultdict
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.command_line import make_parser
from khala_agents.scripted.players import PLAYERS
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_orchestrator.match.match import Match, SilentObserver
from khala_orchestrator.match.scenery import Scenery
from khala_orchestrator.match.side import sides_of
from khala_orchestrator.match.turn import Answer, Answers
from khala_orchestrator.roster import Seat
from khala_protocol.codec import encode
from khala_protocol.keys import Topic, run_key
from khala_protocol.messages import Reply
from khala_protocol.recording import Recorder
from khala_sc2.playing.hosting import game_of
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Iterable, Sequence

    from khala_bridge.game.game import Sides
    from khala_bridge.state import Snapshot
    from khala_bridge.task.config import TaskConfig
    from khala_orchestrator.match.schedule import StepId
    from khala_orchestrator.match.turn import Question
    from khala_protocol.messages import Report, Scene, Terrain

KINDS = ("none", "seen", "whole")
WARM_UP = 6


@dataclass
class Onlookers(SilentObserver):
    """The agents of a match, and those who watch it."""

    recorder: Recorder
    think_s: float
    step_s: defaultdict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    """By what was shown."""
    sizes: list[int] = field(default_factory=list)
    units: list[int] = field(default_factory=list)
    began: float = 0.0

    async def ask(self, questions: Iterable[Question], *, wait: bool = True) -> Answers:  # noqa: ARG002
        """Return the answers of one step."""
        found: dict[Seat, Answer] = {}
        for question in questions:
            seen = question.observation
            began = time.perf_counter()
            text = PLAYERS["skilled"](seen.text, random.Random(f"{seen.agent} {seen.step}"))
            self.began += time.perf_counter() - began
            place = {"run": seen.run, "agent": seen.agent, "side": seen.side, "episode": 0, "step": seen.step}
            found[Seat(seen.side, seen.agent)] = Answer("ok", Reply.model_validate({**place, "text": text}))
        await asyncio.sleep(self.think_s)
        return Answers(found)

    async def terrain(self, terrain: Terrain) -> None:
        """Record it."""
        self.recorder.write(run_key(terrain.run, Topic.TERRAIN), encode(terrain))

    async def scene(self, scene: Scene) -> None:
        """Record it, and note its size."""
        payload = encode(scene)
        self.recorder.write(run_key(scene.run, Topic.SCENE), payload)
        self.sizes.append(len(payload))
        self.units.append(len(scene.units))

    async def report(self, report: Report) -> None:
        """Note how long the step took."""
        now = time.perf_counter()
        if report.step >= WARM_UP:
            self.step_s[KINDS[report.step % len(KINDS)]].append(now - self.began)
        self.recorder.flush()
        self.began = time.perf_counter()


class ByTurns(Scenery):
    """Shows nothing, what is seen, and the whole map, by turns."""

    def __init__(self, task: TaskConfig, game: Sides, onlookers: Onlookers) -> None:
        kinds = [change(task, scenes=kind) for kind in KINDS]
        self._turns = [Scenery(kind, "bench", game, onlookers) for kind in kinds]

    @asynccontextmanager
    async def shown(self, at: StepId, snapshots: Sequence[Snapshot]) -> AsyncIterator[None]:
        """Show the map of a step as its turn is."""
        async with self._turns[at.step % len(KINDS)].shown(at, snapshots):
            yield


def measure(name: str, steps: int, think_s: float, seed: int) -> dict[str, Any]:
    """Return the figures of one match."""
    task = change(load_task(name), max_steps=steps)
    config = MatchConfig(task=task, run="bench", seed=seed)

    async def match(directory: Path) -> Onlookers:
        with Recorder(directory / "scenes.mcap") as recorder:
            onlookers = Onlookers(recorder, think_s)
            async with game_of(config, install(directory / "sc2")) as game:
                scenery = ByTurns(task, game, onlookers)
                played = Match(config, game, sides_of(config), onlookers, onlookers, scenery=scenery)
                async for _ in played.play():
                    pass
        return onlookers

    with tempfile.TemporaryDirectory() as directory:
        seen = asyncio.run(match(Path(directory)))
        file_bytes = (Path(directory) / "scenes.mcap").stat().st_size
    ms = {kind: 1000 * statistics.fmean(seen.step_s[kind]) for kind in KINDS}
    return {
        "task": name,
        "steps": sum(map(len, seen.step_s.values())),
        "units": statistics.fmean(seen.units),
        "bytes": statistics.fmean(seen.sizes),
        "recorded_bytes": file_bytes / len(seen.sizes),
        **{f"{kind}_ms": value for kind, value in ms.items()},
        **{f"{kind}_median_ms": 1000 * statistics.median(seen.step_s[kind]) for kind in KINDS},
    }


def main() -> None:
    """Measure, and print a table or a JSON object."""
    parser = make_parser(__doc__)
    parser.add_argument("tasks", nargs="*", default=["2s3z", "simple64_sceb"])
    parser.add_argument("--steps", type=int, default=300)
    parser.add_argument("--think", type=float, default=0.0, help="seconds that agents think in each step")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    logging.disable(logging.WARNING)  # PySC2 warns of abilities that it has no names for
    rows = [measure(task, options.steps, options.think, options.seed) for task in options.tasks]
    if options.json:
        sys.stdout.write(json.dumps(rows) + "\n")
        return
    for row in rows:
        cells = (
            f"{name} {value:.1f}" if isinstance(value, float) else f"{name} {value}" for name, value in row.items()
        )
        sys.stdout.write("  ".join(cells) + "\n")
