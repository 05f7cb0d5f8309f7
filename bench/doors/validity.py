"""Agents that do not decide, in real matches: the verdict, the exit code and the last line must say so.

`python -m bench doors --door "khala run"` plays these rows among others.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import sys
import time
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from bench.doors.rows import Row
from khala_agents.scripted.canned import Canned, CannedRequest, Given, completion, refusal

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

COMPLETIONS: Final = "/chat/completions"
STEPS: Final = 6
NOT_BEGUN: Final = 1
NOT_VALID: Final = 3
PROMPT_END_S: Final = 30.0
"""A match that cannot get better ends in its first step; what it takes on a busy machine is its start."""
ORDERS: Final = "Actions:\nTeam Stalker-1:\n<No_Operation()>\nTeam Zealot-1:\n<No_Operation()>"
MODEL: Final = """
profile: compatible
model: canned
base_url: BASE_URL
max_tokens: 100
try_timeout_s: 0.5
retry: {tries: 1}
prices: {prompt: 1.0, completion: 1.0}
"""


@dataclass(frozen=True, slots=True)
class Match:
    """What `khala run` said of a match."""

    code: int
    last_line: str
    screen: str
    took_s: float


async def play(directory: Path, *options: str, answer: Callable[[CannedRequest], Given] | Given) -> Match:
    """Play a match whose agents ask an endpoint with given answers."""
    async with Canned(answer) as endpoint:
        (directory / "model.yaml").write_text(MODEL.replace("BASE_URL", endpoint.base_url), encoding="utf-8")
        began = time.perf_counter()
        code, _, screen = await _khala(directory, "run", "2s3z_pair", "--model", "model.yaml", *options)
        took_s = time.perf_counter() - began
    return Match(code, screen.strip().splitlines()[-1], screen, took_s)


async def _khala(directory: Path, *arguments: str) -> tuple[int, str, str]:
    """Run `khala` in a directory; return its exit code, and what it printed on stdout and on stderr."""
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-P", "-m", "khala_sc2", *arguments,
        cwd=directory, env={**os.environ, "COLUMNS": "200"}, start_new_session=True,
        stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE,
    )  # fmt: skip
    printed, said = await process.communicate()
    return process.returncode or 0, printed.decode(), said.decode()


@dataclass(frozen=True, slots=True)
class Said:
    """What must be said of a match.

    Attributes:
        code: of the exit.
        words: of the last line.
        on_screen: words that stand on the screen anywhere.
        options: of `khala run`.
    """

    code: int
    words: tuple[str, ...]
    on_screen: tuple[str, ...] = ()
    options: tuple[str, ...] = ("--max-steps", str(STEPS), "--max-wait", "2")
    at_once: bool = False
    """Whether the match must end in its first step."""


def _dying(after: int) -> Callable[[CannedRequest], Given]:
    """Return an endpoint that answers so many requests, and then fails."""
    left = [after]

    def answer(asked: CannedRequest) -> Given:
        left[0] -= asked.path.endswith(COMPLETIONS)
        return completion(ORDERS) if left[0] >= 0 else refusal(500, "out of memory")

    return answer


RAISING: Final = """
def decide(briefing, observation):
    if observation.step >= 4:
        raise RuntimeError("lost the thread")
    return "Actions:"
"""
LONG: Final = ("--max-steps", "200")
LOG: Final = "its log is in runs/"
CASES: Final[dict[str, tuple[Callable[[], Callable[[CannedRequest], Given] | Given], Said]]] = {
    "answers without a word": (
        lambda: completion(""), Said(NOT_VALID, ("not valid", "Stalkers never decided (6 empty"), (LOG,)),
    ),
    "is cut while it thinks": (
        lambda: completion(None, "length", reasoning_content="The Zealots "),
        Said(NOT_VALID, ("not valid", "Stalkers never decided (6 cut"), ("max_tokens", LOG)),
    ),
    "refuses to play": (
        lambda: completion(None, refusal="I will not play war games."),
        Said(NOT_VALID, ("not valid", "6 refused", "I will not play war games."), (LOG,)),
    ),
    "is filtered": (
        lambda: completion(None, "content_filter"), Said(NOT_VALID, ("not valid", "6 filtered"), (LOG,)),
    ),
    "sends something else than completions": (
        lambda: Given({"hello": "world"}), Said(NOT_VALID, ("not valid", "6 malformed"), (LOG,)),
    ),
    "dies after four answers": (
        lambda: _dying(4), Said(NOT_VALID, ("not valid", "did not make 4 of 6", "limit is 10%"), ("out of memory",)),
    ),
    "does not know the model": (
        lambda: refusal(404, "there is no model 'canned'"),
        Said(NOT_VALID, ("not valid", "will not answer it", "there is no model"), (LOG,), LONG, at_once=True),
    ),
    "does not take the key": (
        lambda: refusal(401, "wrong key"), Said(NOT_BEGUN, ("wrong key",), (), LONG, at_once=True),
    ),
    "takes the key for its list of models alone": (
        lambda: lambda asked: refusal(401, "wrong key") if asked.path.endswith(COMPLETIONS) else Given({"data": []}),
        Said(NOT_VALID, ("not valid", "will not answer it", "wrong key"), (LOG,), LONG, at_once=True),
    ),
    "forbids the model": (
        lambda: refusal(403, "not in your plan"),
        Said(NOT_VALID, ("not valid", "will not answer it", "not in your plan"), (LOG,), LONG, at_once=True),
    ),
    "cannot read the request": (
        lambda: refusal(400, "this request is odd"),
        Said(NOT_VALID, ("not valid", "will not answer it", "this request is odd"), (LOG,), LONG, at_once=True),
    ),
    "decides, and gives no order": (
        lambda: completion("I think for a while."),
        Said(0, ("no order of", "Stalkers", "Zealots", "was carried out")),
    ),
}  # fmt: skip


GRID: Final = f"""
name: grid
fixed: {{task: 2s3z_pair, max_steps: {STEPS}, max_wait_s: 2}}
factors: {{model: {json.dumps([f"{name}.yaml" for name in CASES])}}}
seeds: 1
retries: 0
"""


async def _play(directory: Path, name: str) -> str:
    answer, expected = CASES[name]
    return _fault(await play(directory, *expected.options, answer=answer()), expected)


async def _play_experiment(directory: Path) -> str:
    """Play a match with every model of the table, and look at their rows; one that is not valid is in no number."""
    async with contextlib.AsyncExitStack() as endpoints:
        for name, (answer, _) in CASES.items():
            endpoint = await endpoints.enter_async_context(Canned(answer()))
            (directory / f"{name}.yaml").write_text(MODEL.replace("BASE_URL", endpoint.base_url), encoding="utf-8")
        (directory / "grid.yaml").write_text(GRID, encoding="utf-8")
        code, _, screen = await _khala(directory, "experiment", "run", "grid.yaml")
    if code != NOT_VALID:
        return f"exit code {code}: {screen.strip().splitlines()[-1]}"
    _, printed, _ = await _khala(directory, "experiment", "status", "grid", "--json")
    rows = json.loads(printed)["cells"]
    faults = [_row_fault(row, said) for row, (_, said) in zip(rows, CASES.values(), strict=True)]
    return next(filter(None, faults), "")


def _row_fault(row: dict[str, Any], said: Said) -> str:
    """Return in what a row of an experiment is not as expected; "" if in nothing."""
    if (row["done"], row["invalid"]) != ((1, 0) if said.code == 0 else (0, 1)):
        return f"its row is {row}"
    if said.code and not any(words in cause for cause in row["causes"] for words in said.words):
        return f"its cause is {row}"
    return ""


async def _raise(directory: Path) -> str:
    (directory / "raising.py").write_text(RAISING, encoding="utf-8")
    expected = Said(NOT_VALID, ("not valid", "did not make 2 of 6", "RuntimeError"), ("lost the thread",))
    options = (*expected.options, "--policy", "raising:decide")
    return _fault(await play(directory, *options, answer=completion("")), expected)


def _fault(match: Match, expected: Said) -> str:
    """Return in what a match is not as expected; "" if in nothing."""
    if match.code != expected.code:
        return f"exit code {match.code}: {match.last_line}"
    if missing := [words for words in expected.words if words not in match.last_line]:
        return f"the last line lacks {missing[0]!r}: {match.last_line}"
    if missing := [words for words in expected.on_screen if words not in match.screen]:
        return f"the screen lacks {missing[0]!r}: {match.screen[-400:]}"
    return f"it took {match.took_s:.0f} s" if expected.at_once and match.took_s > PROMPT_END_S else ""


def _rows() -> Iterator[Row]:
    for name in CASES:
        yield Row("khala run", f"a model that {name}", partial(_play, name=name), kind="fault")
    yield Row("khala experiment run", "twelve models, of which one plays", _play_experiment, kind="fault")
    yield Row("khala run", "a policy that raises from step 4 on", _raise, kind="fault")


ROWS: Final[tuple[Row, ...]] = tuple(_rows())
