"""Attack experiments: kill the runner, and let the endpoint charge and refuse.

    python -m bench experiments kills --kills 5     SIGKILL the runner in the middle, and resume until all is played
    python -m bench experiments money --usd 0.25    a third of the requests get 429, the others are charged

`kills` compares every number of every match, but for wall times, with the same experiment that nobody disturbed.
`money` compares what the endpoint charged with the cap, and the pilot's estimate with what a whole experiment cost.
The exit code is 1 if a table differs, the cap was exceeded, or the estimate is off by more than `MOST_OFF`.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import random
import re
import signal
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from aiohttp import web

from bench.command_line import make_parser
from khala_agents.scripted.endpoint import Behaviour, Endpoint
from khala_agents.scripted.faults import InjectedFaults, parse_faults
from khala_protocol.configfile import load
from khala_sc2.experiment.commands import words_of
from khala_sc2.experiment.engine import Local
from khala_sc2.experiment.plan import plan
from khala_sc2.experiment.runner import Runner, pilot_of
from khala_sc2.experiment.spec import Experiment, ExperimentBudget
from khala_sc2.experiment.store import Store

MOST_OFF = 0.2
FILE = """
name: attacked
fixed: {{max_steps: {steps}, max_wait_s: 60}}
factors:
  task: [2s3z_pair, 3s5z]
  player: [{{name: skilled, model: {skilled}}}, {{name: focus, model: {focus}}}]
seeds: {seeds}
"""
MODEL = """
profile: compatible
model: {player}
base_url: {base_url}
max_tokens: 400
prices: {{prompt: 2.0, completion: 8.0}}
retry: {{tries: 6, base_s: 0.05, cap_s: 0.5, jitter_s: 0.05}}
"""
NOT_COMPARED = re.compile(r"wall_s|latency|_ms$")


def write(directory: Path, *, seeds: int, steps: int, skilled: str = "skilled", focus: str = "focus-fire") -> Path:
    """Write the file of the experiment."""
    path = directory / "attacked.yaml"
    path.write_text(FILE.format(seeds=seeds, steps=steps, skilled=skilled, focus=focus))
    return path


async def run(file: Path, out: Path, *more: str, kill_after_s: float | None = None) -> int:
    """Run `khala experiment run`; return its exit code, or that of SIGKILL after some seconds."""
    command = [sys.executable, "-m", "khala_sc2", "experiment", "run", str(file), "--out", str(out), "--yes", *more]
    process = await asyncio.create_subprocess_exec(*command, start_new_session=True)
    try:
        async with asyncio.timeout(kill_after_s):
            return await process.wait()
    except TimeoutError:
        with contextlib.suppress(ProcessLookupError):
            process.send_signal(signal.SIGKILL)
        return await process.wait()


def numbers(store: Store) -> dict[str, dict[str, Any]]:
    """Return what was measured of each match, but for times of this machine."""
    return {
        f"{row['match']} {row['side']}": {name: value for name, value in row.items() if not NOT_COMPARED.search(name)}
        for row in store.results()
    }


@dataclass(frozen=True)
class Killed:
    """What was left of a runner that was killed again and again."""

    kills: int
    matches: int
    differ: list[str]
    """Matches whose numbers differ from those of an undisturbed experiment."""
    doubled: int
    """Recordings with a result beyond one a match."""

    @property
    def is_good(self) -> bool:
        return not self.differ and not self.doubled and self.matches > 0


async def kills(
    count: int, seed: int, *, seeds: int = 4, steps: int = 10, after_s: tuple[float, float] = (6, 14)
) -> Killed:
    """Kill the runner at some moments, and compare the end with an undisturbed one."""
    chance = random.Random(seed)
    with tempfile.TemporaryDirectory() as place:
        file = write(Path(place), seeds=seeds, steps=steps)
        killed = 0
        while killed < count and await run(file, Path(place) / "killed", kill_after_s=chance.uniform(*after_s)) < 0:
            killed += 1
        await run(file, Path(place) / "killed")
        await run(file, Path(place) / "calm")
        found, calm = Store(Path(place) / "killed" / "attacked"), Store(Path(place) / "calm" / "attacked")
        ours, theirs = numbers(found), numbers(calm)
        differ = [key for key in {**ours, **theirs} if ours.get(key) != theirs.get(key)]
        tries = [found.read(path, attempts=1) for path in found.directory.glob("matches/*/*.mcap")]
        whole = [read for read in tries if read is not None and read[0].state == "done"]
        return Killed(killed, len(ours), differ, len(whole) - len(found.matches()))


class Charging(Endpoint):
    """The scripted endpoint, with an account of what it would charge."""

    charged_usd = 0.0
    refused = 0

    async def _complete(self, request: web.Request) -> web.StreamResponse:
        response = await super()._complete(request)
        if isinstance(response, web.Response) and response.status == 200:
            usage = json.loads(response.text or "")["usage"]
            self.charged_usd += (2.0 * usage["prompt_tokens"] + 8.0 * usage["completion_tokens"]) / 1e6
        else:
            self.refused += 1
        return response


@dataclass(frozen=True)
class Money:
    """What an experiment was charged."""

    cap_usd: float
    charged_usd: float
    noted_usd: float
    """As the experiment's own account has it."""
    refused: int
    requests: int
    estimate_usd: float
    """Of the pilot, for the whole experiment."""
    whole_usd: float
    """Charged for the whole experiment, without a cap."""

    @property
    def off(self) -> float:
        return abs(self.estimate_usd - self.whole_usd) / self.whole_usd

    @property
    def is_good(self) -> bool:
        return self.charged_usd <= self.cap_usd and self.off <= MOST_OFF


async def money(cap_usd: float, *, seeds: int = 6, steps: int = 8, pilot: int = 2, slots: int = 2) -> Money:
    """Play a capped experiment and a whole one, with an endpoint that refuses a third of the requests."""
    faults = InjectedFaults(parse_faults(["429=0.33"]), seed=3)
    with tempfile.TemporaryDirectory() as place:
        here = Path(place)
        async with Charging(Behaviour(faults=faults, retry_after_s=0.05)) as endpoint:
            models = {}
            for player in ("skilled", "focus-fire"):
                models[player] = here / f"{player}.yaml"
                models[player].write_text(MODEL.format(player=player, base_url=endpoint.base_url))
            file = write(
                here, seeds=seeds, steps=steps, skilled=str(models["skilled"]), focus=str(models["focus-fire"])
            )
            capped = await _account(file, here / "capped", cap_usd, 0, slots)
            charged, refused, requests = endpoint.charged_usd, endpoint.refused, endpoint.requests
            endpoint.charged_usd = 0.0
            whole = await _account(file, here / "whole", None, pilot, slots)
            return Money(cap_usd, charged, capped[0], refused, requests, whole[1], endpoint.charged_usd)


async def _account(file: Path, out: Path, cap_usd: float | None, pilot: int, slots: int) -> tuple[float, float]:
    """Return what an experiment has cost by its own account, and what its pilot estimated."""
    experiment = load(file, Experiment)
    store = Store(out)
    matches = plan(experiment)
    estimated = 0.0
    store.begin(file)
    async with Local(slots, game="simulator", logs=store.logs) as engine:
        runner = Runner(experiment, store, engine, ExperimentBudget(usd=cap_usd))
        if pilot:
            await runner.play(pilot_of(matches, pilot))
            rest = runner.estimate(matches)
            print(words_of(rest, len(matches)), file=sys.stderr)
            estimated = runner.spent.usd + (rest.usd or 0.0)
        await runner.play(matches)
    print(f"{len(store.matches())} matches; {runner.stopped}", file=sys.stderr)
    return runner.spent.usd, estimated


def main() -> int:
    parser = make_parser(__doc__, json=False)
    parser.add_argument("what", choices=["kills", "money"])
    parser.add_argument("--kills", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1, help="of the moments of the kills")
    parser.add_argument("--usd", type=float, default=0.25, help="cap of the experiment")
    given = parser.parse_args()
    found: Killed | Money
    match given.what:
        case "kills":
            found = asyncio.run(kills(given.kills, given.seed))
        case _:
            found = asyncio.run(money(given.usd))
    print(found)
    return 0 if found.is_good else 1
