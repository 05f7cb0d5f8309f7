"""Read files that are made to do harm: mutated task, model and agents files, scenarios of maps, and recordings.

    python -m bench hostile_files                                              3000 of each
    python -m bench hostile_files --files 10000 --recordings 10000 --seed 7

Every file is read, or refused by an error of one sentence, a `KhalaError` or a `ScenarioError`. Anything else is
counted, and printed with the seed of its case: another exception, a case of more than 250 ms of CPU, more than 300 MB
of memory. The exit code is then 1.
"""

from __future__ import annotations

import contextlib
import json
import random
import resource
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

import yaml
from rich.console import Console

from bench.command_line import make_parser
from bench.paths import GOLDEN
from khala_agents.config import AgentsFile, ModelConfig
from khala_bridge.task.config import TaskConfig
from khala_configs import CONFIGS
from khala_orchestrator.past.replay import recorded_config
from khala_orchestrator.past.transcript import StepSelection, summary, transcript
from khala_protocol.configfile import load
from khala_protocol.errors import KhalaError, RecordingError
from khala_protocol.recording import Recorder, Recording, read
from khala_simulator.maps.game_map import map_names
from khala_simulator.maps.nodes import ScenarioError
from khala_simulator.maps.scenario_file import read_scenario, sheets

if TYPE_CHECKING:
    from collections.abc import Callable

    from pydantic import BaseModel

SLOWEST_MS = 250.0
MOST_MB = 300.0
SAMPLES = 24
"""Samples of the recording that is mutated, its first ones: a whole one takes as long to read when nothing is wrong."""
MODELS: dict[str, type[BaseModel]] = {"tasks": TaskConfig, "models": ModelConfig, "agents": AgentsFile}

NUMBERS = ("9" * 5000, "-1", "1e999", ".nan", "0x" + "f" * 400, "99999999999999999999", "1:" * 300 + "1", "2026-02-31")
CHARACTERS = (
    "\0",
    "\x1b[2J",
    "\u202e",
    "\ud7ff\ue000",
    "\x85",
    "\ufeff",
    "\t",
    "\\",
    '"',
    "{",
    "]",
    "&a ",
    "*a",
    "!!x ",
)
BOMBS = (
    "\n".join(["a0: &a0 [x]", *(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 12))]),
    "\n".join(["m0: &m0 {x: 1}", *(f"m{i}: &m{i} {{<<: [{', '.join([f'*m{i - 1}'] * 9)}]}}" for i in range(1, 12))]),
    "r: &r [*r, *r]",
    "s: &s {<<: *s}",
    "deep: " + "[" * 3000,
    "braces: " + "{a: " * 3000,
    "wide: [" + "a," * 100_000 + "]",
    "? " * 2000,
    "\n".join(" " * i + "a:" for i in range(500)),
)


@dataclass
class Tally:
    """What happened to the cases of one kind.

    Attributes:
        cases: number of cases.
        read: how many were read, and not refused.
        violations: what no case may do.
        slowest_ms: CPU time of the slowest case.
        slowest: the name of that case.
    """

    cases: int = 0
    read: int = 0
    violations: list[str] = field(default_factory=list)
    slowest_ms: float = 0.0
    slowest: str = ""

    def judge(self, name: str, case: Callable[[], object]) -> None:
        """Run a case, and count what it does; a slow case counts as its fastest of three runs."""
        self.cases += 1
        began = time.process_time()
        try:
            case()
            self.read += 1
        except (KhalaError, ScenarioError):
            pass
        except Exception as error:  # noqa: BLE001  # to find them is the purpose
            self.violations.append(f"{name}: {type(error).__name__}: {str(error)[:200]}")
        spent_ms = 1000 * (time.process_time() - began)
        if spent_ms > SLOWEST_MS:  # other processes slow the caches down, and a collection of garbage may fall into it
            spent_ms = min(spent_ms, *(_spent_ms(case) for _ in range(2)))
        if spent_ms > self.slowest_ms:
            self.slowest_ms, self.slowest = spent_ms, name


def _spent_ms(case: Callable[[], object]) -> float:
    """Return the CPU time of a case; how it ends is not judged again."""
    began = time.process_time()
    with contextlib.suppress(Exception):
        case()
    return 1000 * (time.process_time() - began)


def mutate(text: str, other: str, dice: random.Random) -> str:
    """Return a text with some changes, most often one; `other` gives pieces to splice in."""
    for _ in range(dice.choice((1, 1, 2, 4))):
        text = dice.choice(_CHANGES)(text, other, dice)
    return text


def _flip(text: str, _: str, dice: random.Random) -> str:
    at = dice.randrange(len(text) + 1)
    return text[:at] + dice.choice((*CHARACTERS, chr(dice.randrange(1, 0xD7FF)))) + text[at + dice.randint(0, 2) :]


def _cut(text: str, _: str, dice: random.Random) -> str:
    first, last = sorted(dice.randrange(len(text) + 1) for _ in range(2))
    return dice.choice((text[:first], text[:first] + text[last:], text[:last] + text[first:]))


def _splice(text: str, other: str, dice: random.Random) -> str:
    at, begin = dice.randrange(len(text) + 1), dice.randrange(len(other) + 1)
    return text[:at] + other[begin : begin + dice.randint(1, 400)] + text[at:]


def _swap(text: str, _: str, dice: random.Random) -> str:
    words = text.split(" ")
    first, second = dice.randrange(len(words)), dice.randrange(len(words))
    words[first], words[second] = words[second], words[first]
    return " ".join(words)


def _number(text: str, _: str, dice: random.Random) -> str:
    lines = text.split("\n")
    at = dice.randrange(len(lines))
    head, colon, _rest = lines[at].partition(":")
    lines[at] = f"{head}{colon or ':'} {dice.choice(NUMBERS)}"
    return "\n".join(lines)


def _long(text: str, _: str, dice: random.Random) -> str:
    at = dice.randrange(len(text) + 1)
    return text[:at] + dice.choice("aA_-.0 :[{\n") * dice.randint(1, 20_000) + text[at:]


def _bomb(text: str, _: str, dice: random.Random) -> str:
    bomb = dice.choice(BOMBS)
    return dice.choice((f"{bomb}\n{text}", f"{text}\n{bomb}", bomb))


_CHANGES = (_flip, _flip, _flip, _cut, _splice, _swap, _number, _long, _bomb)


# --- files --------------------------------------------------------------------------------------------------


def files(count: int, seed: int, directory: Path) -> Tally:
    """Read mutations of all shipped files; they stand beside unchanged ones, which they may extend."""
    tally = Tally()
    shipped = [(path, model) for kind, model in MODELS.items() for path in sorted((CONFIGS / kind).rglob("*.yaml"))]
    for path, _ in shipped:
        (directory / path.name).write_bytes(path.read_bytes())
    load(shipped[0][0], shipped[0][1])  # reads the tables of the game, which takes 300 ms
    for number in range(count):
        dice = random.Random(f"{seed} {number}")
        (path, model), (other, _) = dice.choice(shipped), dice.choice(shipped)
        text = mutate(path.read_text(encoding="utf-8"), other.read_text(encoding="utf-8"), dice)
        hostile = directory / "hostile.yaml"
        hostile.write_bytes(_bytes(text, dice))
        tally.judge(f"file {seed} {number}, of {path.name}", lambda: load(hostile, model))  # noqa: B023  # called at once
    return tally


def _bytes(text: str, dice: random.Random) -> bytes:
    data = bytearray(text.encode("utf-8", "replace"))
    if data and dice.random() < 0.1:
        data[dice.randrange(len(data))] = dice.randrange(256)
    return bytes(data)


# --- scenarios ----------------------------------------------------------------------------------------------


def scenarios(count: int, seed: int, directory: Path) -> Tally:
    """Read mutations of the scenarios of all shipped maps."""
    tally = Tally()
    maps = resources.files("khala_simulator.data") / "maps"
    shipped = {
        name: yaml.safe_dump(sheet.data(), sort_keys=False)
        for family in {name.partition("/")[0] for name in map_names()}
        for file in (maps / family).iterdir()
        if file.name.endswith(".yaml")
        for name, sheet in sheets(file.read_text(encoding="utf-8"), file.name)
    }
    names = sorted(shipped)
    for number in range(count):
        dice = random.Random(f"{seed} {number}")
        name, other = dice.choice(names), dice.choice(names)
        hostile = directory / "scenario.yaml"
        hostile.write_bytes(_bytes(mutate(shipped[name], shipped[other], dice), dice))
        tally.judge(f"scenario {seed} {number}, of {name}", lambda: read_scenario(hostile))  # noqa: B023  # called at once
    return tally


# --- recordings ---------------------------------------------------------------------------------------------


def recordings(count: int, seed: int, directory: Path) -> Tally:
    """Read mutations of a recording: of its bytes, and of its samples with whole chunks around them."""
    tally = Tally()
    samples = [(sample.key, sample.payload) for sample in read(GOLDEN)][:SAMPLES]
    whole = _written(directory / "whole.mcap", samples).read_bytes()
    _show(directory / "whole.mcap")
    for number in range(count):
        dice = random.Random(f"{seed} {number}")
        path = directory / f"{number}.mcap"
        if dice.random() < 0.5:
            path.write_bytes(_damage(whole, dice))
        else:
            _written(path, _change(samples, dice))
        tally.judge(f"recording {seed} {number}", lambda: _show(path))  # noqa: B023  # called at once
        path.unlink()
    return tally


def _written(path: Path, samples: list[tuple[str, bytes]]) -> Path:
    with Recorder(path) as recorder:
        for number, (key, payload) in enumerate(samples):
            recorder.write(key, payload)
            if number % 10 == 0:
                recorder.flush()
    return path


def _damage(whole: bytes, dice: random.Random) -> bytes:
    data = bytearray(whole)
    for _ in range(dice.randint(1, 8)):
        at = dice.randrange(len(data))
        match dice.randrange(5):
            case 0:
                data[at] ^= 1 << dice.randrange(8)
            case 1:
                data = data[: at + 1]
            case 2:
                begin = dice.randrange(len(data))
                data[at:at] = data[begin : begin + dice.randint(1, 4000)]
            case 3:
                data[at : at + 8] = dice.choice((b"\xff" * 8, b"\0" * 8, (2**26 - 1).to_bytes(8, "little")))
            case _:
                del data[at : at + dice.randint(1, 4000)]
        data = data or bytearray(b"\0")
    return bytes(data)


def _change(samples: list[tuple[str, bytes]], dice: random.Random) -> list[tuple[str, bytes]]:
    changed = list(samples)
    for _ in range(dice.randint(1, 6)):
        at = dice.randrange(len(changed))
        key, payload = changed[at]
        other = dice.choice(changed)
        match dice.randrange(4):
            case 0:
                key = mutate(key, other[0], dice)[:1000].encode("utf-8", "replace").decode()
            case 1:
                key = other[0]
            case 2:
                changed.insert(dice.randrange(len(changed)), other)
            case _:
                text = payload.decode("utf-8", "replace")
                payload = _json(text, other[1].decode("utf-8", "replace"), dice).encode("utf-8", "replace")
        changed[at] = key, payload
    return changed


def _json(text: str, other: str, dice: random.Random) -> str:
    """Return changed JSON: often one that still is JSON, with another value somewhere."""
    if dice.random() < 0.4:
        return mutate(text, other, dice)
    values = (
        "1" + "0" * 400,
        "-1",
        "1e308",
        "null",
        "[]",
        '""',
        "9" * 4000,
        '"\\ud800"',
        '"\\u001b[2J"',
        "[" * 900 + "]" * 900,
    )
    parts = text.split(",")
    at = dice.randrange(len(parts))
    head, colon, _ = parts[at].partition(":")
    parts[at] = f"{head}{colon}{dice.choice(values)}"
    return ",".join(parts)


def _show(path: Path) -> None:
    """Do with a recording what the commands do."""
    recording = Recording.open(path)
    console = _nowhere()
    for part in transcript(path, StepSelection(), whole=True):
        console.print(part)
    json.dumps(summary(path, StepSelection()))
    for _ in recording.by_step():
        pass
    try:
        recorded_config(recording)
    except RecordingError:
        return


@cache
def _nowhere() -> Console:
    return Console(file=Path("/dev/null").open("w", encoding="utf-8"), width=100)  # for the process


# --- the table ----------------------------------------------------------------------------------------------


def measure(count_files: int, count_recordings: int, seed: int) -> dict[str, Tally]:
    """Return the tallies of files, of as many scenarios, and of recordings."""
    with tempfile.TemporaryDirectory() as directory:
        return {
            "files": files(count_files, seed, Path(directory)),
            "scenarios": scenarios(count_files, seed, Path(directory)),
            "recordings": recordings(count_recordings, seed, Path(directory)),
        }


def resident_mb() -> float:
    """Return the largest memory that this process has had."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    """Print what happened; end with 1 if anything did that must not."""
    options = make_parser(__doc__)
    options.add_argument("--files", type=int, default=3000)
    options.add_argument("--recordings", type=int, default=3000)
    options.add_argument("--seed", type=int, default=1)
    given = options.parse_args()
    before_mb = resident_mb()
    tallies = measure(given.files, given.recordings, given.seed)
    grown_mb = resident_mb() - before_mb
    violations = [line for tally in tallies.values() for line in tally.violations]
    violations += [f"{t.slowest}: {t.slowest_ms:.0f} ms" for t in tallies.values() if t.slowest_ms > SLOWEST_MS]
    if grown_mb > MOST_MB:
        violations.append(f"memory grew by {grown_mb:.0f} MB")
    if given.json:
        kinds = {
            kind: {"cases": t.cases, "read": t.read, "violations": len(t.violations), "slowest_ms": t.slowest_ms}
            for kind, t in tallies.items()
        }
        print(json.dumps({**kinds, "grown_mb": grown_mb, "violations": violations}))
    else:
        for kind, tally in tallies.items():
            print(
                f"{kind}: {tally.cases} cases, {tally.read} read, {len(tally.violations)} violations, "
                f"slowest {tally.slowest_ms:.0f} ms of CPU"
            )
        print(f"memory grew by {grown_mb:.0f} MB to {resident_mb():.0f} MB")
        for text, times in Counter(violations).most_common(40):
            print(f"  {times} x {text}" if times > 1 else f"  {text}")
    sys.exit(bool(violations))
