"""Spend a budget at an endpoint that counts what it bills, and hold the bill against the cap.

    python -m bench money                              all kinds of trouble, caps of 0.05, 0.30 and 1.00, 1 and 8 jobs
    python -m bench money --kind late --cap 0.3        some of them
    python -m bench money --experiment                 whole experiments in place of single agents, N matches at once

Each job is an agent with a ledger of its own on the same file, as processes of a match have; the clients, limits and
retries are the real ones. The endpoint bills every answer that it began to write, whether or not it arrived, by a
count of tokens that is less favourable than ours. With --experiment, `khala experiment run --budget-usd CAP --jobs N`
plays matches of two agents, until the budget is used up. The exit code is 1 if more was billed than the cap in any row.

`billed` is what the endpoint counts, `booked` what the ledger says, `used` the part of the cap that was billed: the
rest was held for requests of which nobody knows what they cost. Seen: docs/measurements.md.
"""

from __future__ import annotations

import asyncio
import itertools
import json
import logging
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self

from aiohttp import web

from bench.command_line import make_parser
from bench.paths import GOLDEN
from bench.tables import print_table
from khala_agents.build import Workshop
from khala_agents.config import WorkerSpec
from khala_agents.llm.client import LLMError
from khala_agents.llm.money import MoneyLedger, SharedBudget
from khala_agents.llm.pricing import Prices
from khala_agents.policy import Context
from khala_protocol.messages import Briefing, Observation
from khala_protocol.recording import Recording

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Sequence

PRICES: Final = Prices(prompt=2.0, completion=8.0)
CAPS: Final = (0.05, 0.30, 1.00)
JOBS: Final = (1, 8)
ANSWER_TOKENS, LIMIT_TOKENS = 60, 200
BYTES_A_TOKEN: Final = 3.0
"""Of a prompt, as the endpoint counts; 4 as we estimate."""
LATE_S: Final = 0.2
"""Time of a try; an answer that is late takes twice as long."""
MOST_REQUESTS: Final = 2000
MODEL: Final = f"""
profile: compatible
model: billed
base_url: BASE_URL
max_tokens: {LIMIT_TOKENS}
try_timeout_s: {LATE_S}
prices: {{prompt: {PRICES.prompt}, completion: {PRICES.completion}}}
retry: {{tries: 2, base_s: 0, cap_s: 0, jitter_s: 0}}
breaker: {{failures: 1000}}
"""


EXPERIMENT: Final = """
name: billed
fixed: {task: 2s3z_pair, model: billed.yaml, max_steps: 8, max_wait_s: 1}
factors: {clock: [frozen]}
seeds: 12
retries: 0
"""


@dataclass(frozen=True, slots=True)
class Spent:
    """What became of a budget."""

    kind: str
    cap_usd: float
    jobs: int
    requests: int
    billed_usd: float
    booked_usd: float

    @property
    def kept(self) -> bool:
        """Whether no more was billed than booked, and no more was booked than the cap."""
        return self.billed_usd <= self.booked_usd + 1e-9 <= self.cap_usd + 2e-9

    @property
    def used(self) -> float:
        """The part of the cap that was billed."""
        return self.billed_usd / self.cap_usd


class BillingEndpoint:
    """A server of chat completions that is in some kind of trouble, and bills. An asynchronous context manager."""

    def __init__(self, kind: str) -> None:
        self.base_url = ""
        self.requests = 0
        self.billed_usd = 0.0
        self._trouble = KINDS[kind]
        self._runner: web.AppRunner | None = None

    async def __aenter__(self) -> Self:
        application = web.Application(client_max_size=2**25)
        application.router.add_post("/v1/chat/completions", self._complete)
        self._runner = web.AppRunner(application, access_log=None, handle_signals=False, shutdown_timeout=0.1)
        await self._runner.setup()
        await web.TCPSite(self._runner, "127.0.0.1", 0, backlog=1024).start()
        self.base_url = f"http://127.0.0.1:{self._runner.addresses[0][1]}/v1"
        return self

    async def __aexit__(self, *error: object) -> None:
        assert self._runner is not None
        await self._runner.cleanup()

    def bill(self, asked: Asked) -> None:
        """Charge an answer, also one that will not arrive."""
        self.billed_usd += PRICES.cost_usd(prompt=asked.prompt_tokens, completion=ANSWER_TOKENS) or 0.0

    async def _complete(self, request: web.Request) -> web.StreamResponse:
        self.requests += 1
        body = await request.read()
        return await self._trouble(self, Asked(request, self.requests, int(len(body) / BYTES_A_TOKEN)))


@dataclass(frozen=True, slots=True)
class Asked:
    """One request."""

    request: web.Request
    number: int
    prompt_tokens: int

    def answer(self, *, content: str | None = "Actions:\n", finish: str = "stop", **changes: Any) -> web.Response:
        """Return a completion."""
        usage = {"prompt_tokens": self.prompt_tokens, "completion_tokens": ANSWER_TOKENS}
        message = {"role": "assistant", "content": content}
        choice = {"index": 0, "message": message, "finish_reason": finish}
        return web.json_response({"model": "billed", "choices": [choice], "usage": usage, **changes})

    def cut(self) -> web.Response:
        """Close the connection."""
        if self.request.transport is not None:
            self.request.transport.abort()
        return web.Response()


# --- kinds of trouble ---------------------------------------------------------------------------------


async def fine(endpoint: BillingEndpoint, asked: Asked) -> web.StreamResponse:
    """Answer."""
    endpoint.bill(asked)
    return asked.answer()


async def late(endpoint: BillingEndpoint, asked: Asked) -> web.StreamResponse:
    """Answer when nobody waits any more."""
    endpoint.bill(asked)
    await asyncio.sleep(2 * LATE_S)
    return asked.answer()


async def half_late(endpoint: BillingEndpoint, asked: Asked) -> web.StreamResponse:
    """Answer every other request late."""
    return await (late if asked.number % 2 else fine)(endpoint, asked)


async def without_usage(endpoint: BillingEndpoint, asked: Asked) -> web.StreamResponse:
    """Say nothing of tokens."""
    endpoint.bill(asked)
    return asked.answer(usage=None)


async def null_usage(endpoint: BillingEndpoint, asked: Asked) -> web.StreamResponse:
    """Count tokens as null."""
    endpoint.bill(asked)
    return asked.answer(usage={"prompt_tokens": None, "completion_tokens": None})


async def cut_in_the_body(endpoint: BillingEndpoint, asked: Asked) -> web.StreamResponse:
    """Break the connection in the middle of the answer."""
    endpoint.bill(asked)
    response = web.StreamResponse(headers={"Content-Type": "application/json"})
    response.content_length = 500
    await response.prepare(asked.request)
    await response.write(b'{"choices": [')
    return asked.cut()


async def cut_before_the_answer(endpoint: BillingEndpoint, asked: Asked) -> web.StreamResponse:
    """Break the connection once the answer was written."""
    endpoint.bill(asked)
    return asked.cut()


async def error_after_the_answer(endpoint: BillingEndpoint, asked: Asked) -> web.StreamResponse:
    """Fail after the model has written."""
    endpoint.bill(asked)
    return web.json_response({"error": {"message": "lost the answer"}}, status=500)


async def gateway_timeout(endpoint: BillingEndpoint, asked: Asked) -> web.StreamResponse:
    """Be a gateway that did not wait."""
    endpoint.bill(asked)
    return web.Response(status=504, text="upstream timed out")


async def not_json(endpoint: BillingEndpoint, asked: Asked) -> web.StreamResponse:
    """Send something else than a completion."""
    endpoint.bill(asked)
    return web.Response(text="<html>")


async def no_choices(endpoint: BillingEndpoint, asked: Asked) -> web.StreamResponse:
    """Send a completion without a choice."""
    endpoint.bill(asked)
    return asked.answer(choices=[])


async def finish_error(endpoint: BillingEndpoint, asked: Asked) -> web.StreamResponse:
    """Break off within a completion, and say so."""
    endpoint.bill(asked)
    return asked.answer(content="Act", finish="error")


async def empty(endpoint: BillingEndpoint, asked: Asked) -> web.StreamResponse:
    """Say nothing, at the usual price."""
    endpoint.bill(asked)
    return asked.answer(content=None, finish="length")


async def retried_once(endpoint: BillingEndpoint, asked: Asked) -> web.StreamResponse:
    """Fail at every first try."""
    return await (error_after_the_answer if asked.number % 2 else fine)(endpoint, asked)


async def too_many_requests(endpoint: BillingEndpoint, asked: Asked) -> web.StreamResponse:
    """Turn away two of three requests, which costs nothing."""
    if asked.number % 3:
        return web.json_response({"error": {"message": "slow down"}}, status=429)
    return await fine(endpoint, asked)


async def more_than_estimated(endpoint: BillingEndpoint, asked: Asked) -> web.StreamResponse:
    """Count half as many tokens again."""
    return await fine(endpoint, Asked(asked.request, asked.number, asked.prompt_tokens * 3 // 2))


KINDS: Final[dict[str, Callable[[BillingEndpoint, Asked], Awaitable[web.StreamResponse]]]] = {
    trouble.__name__.replace("_", " "): trouble
    for trouble in (
        fine, late, half_late, without_usage, null_usage, cut_in_the_body, cut_before_the_answer,
        error_after_the_answer, gateway_timeout, not_json, no_choices, finish_error, empty, retried_once,
        too_many_requests, more_than_estimated,
    )
}  # fmt: skip


# --- spending -----------------------------------------------------------------------------------------


async def spend(kind: str, cap_usd: float, jobs: int, directory: Path) -> Spent:
    """Let agents ask an endpoint in trouble until their budget is used up; return what was spent."""
    ledger = directory / f"{kind}-{cap_usd}-{jobs}.ledger".replace(" ", "-")
    async with BillingEndpoint(kind) as endpoint:
        model = directory / "billed.yaml"
        model.write_text(MODEL.replace("BASE_URL", endpoint.base_url))
        await asyncio.gather(*(_ask(endpoint, model, cap_usd, ledger, job) for job in range(jobs)))
        await asyncio.sleep(0)
        booked_usd = MoneyLedger(ledger).booked_usd()
        return Spent(kind, cap_usd, jobs, endpoint.requests, endpoint.billed_usd, booked_usd)


async def _ask(endpoint: BillingEndpoint, model: Path, cap_usd: float, path: Path, job: int) -> None:
    """Decide again and again, as one agent, until its budget refuses."""
    with MoneyLedger(path) as ledger:
        policy = Workshop(budget=SharedBudget(cap_usd, ledger=ledger)).policy(WorkerSpec(model=str(model)))
        briefing, seen = _scene()
        try:
            while endpoint.requests < MOST_REQUESTS:
                try:
                    async with asyncio.timeout(None if job % 2 else 1.5 * LATE_S):  # some are cancelled, others give up
                        await policy.decide(Context(briefing, seen))
                except LLMError as error:
                    if error.status == "budget":
                        return
                except TimeoutError:
                    pass
        finally:
            await policy.close()


async def play(kind: str, cap_usd: float, jobs: int, directory: Path) -> Spent:
    """Play an experiment whose models ask an endpoint in trouble, and return what was spent."""
    place = directory / f"{kind}-{cap_usd}-{jobs}".replace(" ", "-")
    place.mkdir()
    async with BillingEndpoint(kind) as endpoint:
        (place / "billed.yaml").write_text(MODEL.replace("BASE_URL", endpoint.base_url))
        (place / "grid.yaml").write_text(EXPERIMENT)
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-P", "-m", "khala_sc2", "experiment", "run", "grid.yaml", "--budget-usd", str(cap_usd),
            "--jobs", str(jobs), "--json", cwd=place, stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.DEVNULL,
        )  # fmt: skip
        said, _ = await process.communicate()
        booked_usd = json.loads(said)["cost_usd"]
        return Spent(kind, cap_usd, jobs, endpoint.requests, endpoint.billed_usd, booked_usd)


def _scene() -> tuple[Briefing, Observation]:
    """Return a briefing and an observation of a recorded match, without a deadline."""
    recording = Recording.open(GOLDEN)
    briefing, seen = next(recording.of(Briefing)), next(recording.of(Observation))
    assert isinstance(briefing, Briefing)
    assert isinstance(seen, Observation)
    return briefing, seen.but(answer_within_s=None)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = make_parser(__doc__)
    parser.add_argument("--kind", action="append", choices=KINDS, help="only these kinds of trouble")
    parser.add_argument("--cap", action="append", type=float, help="only these caps, in US dollars")
    parser.add_argument("--jobs", action="append", type=int, help="only these numbers of agents at once")
    parser.add_argument("--experiment", action="store_true", help="play experiments, with so many matches at once")
    given = parser.parse_args(arguments)
    logging.disable(logging.ERROR)
    rows = []
    with tempfile.TemporaryDirectory(prefix="khala-money-") as directory:
        for kind, cap_usd, jobs in itertools.product(given.kind or KINDS, given.cap or CAPS, given.jobs or JOBS):
            how = play if given.experiment else spend
            rows.append(asyncio.run(how(kind, cap_usd, jobs, Path(directory))))
    if given.json:
        print(json.dumps([asdict(row) | {"kept": row.kept} for row in rows]))
    else:
        print_table(
            ("trouble", "cap", "jobs", "requests", "billed", "booked", "used", ""),
            [
                (row.kind, f"{row.cap_usd:.2f}", row.jobs, row.requests, f"{row.billed_usd:.4f}",
                 f"{row.booked_usd:.4f}", f"{row.used:.0%}", "kept" if row.kept else "EXCEEDED")
                for row in rows
            ],
            left=("",),
        )  # fmt: skip
    return 0 if all(row.kept for row in rows) else 1
