"""Money: what was sent is booked at the most that it may cost, until its cost is known, in every process."""

from __future__ import annotations

import asyncio
import signal
import sqlite3
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from khala_agents.llm.client import LimitExceeded
from khala_agents.llm.money import MoneyLedger, SharedBudget
from khala_agents.llm.pricing import Prices, check_priced, list_prices, price_of
from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from pathlib import Path

ENDPOINT = "https://api.openai.com/v1"


async def test_a_request_of_known_cost_gives_the_rest_back() -> None:
    budget = SharedBudget(1.0)
    async with budget.holding(0.8) as bill:
        assert budget.booked_usd == pytest.approx(0.8)
        bill.settle(0.1)
    assert budget.booked_usd == pytest.approx(0.1)


async def test_a_request_that_was_cancelled_is_booked_at_the_most_that_it_may_cost() -> None:
    budget, begun = SharedBudget(1.0), asyncio.Event()

    async def ask() -> None:
        async with budget.holding(0.8):
            begun.set()
            await asyncio.Event().wait()

    asking = asyncio.create_task(ask())
    await begun.wait()
    asking.cancel()
    await asyncio.gather(asking, return_exceptions=True)
    assert budget.booked_usd == pytest.approx(0.8)
    with pytest.raises(LimitExceeded) as caught:
        await spend(budget, 0.3)
    assert str(caught.value) == (
        "the budget is 1 USD, of which 0.8000 are spent and 0.0000 held for requests under way: the next request may "
        "cost 0.3000"
    )


async def spend(budget: SharedBudget, most_usd: float, usd: float | None = None, deadline: float | None = None) -> None:
    """Make a request of a known cost, or an unknown one."""
    async with budget.holding(most_usd, deadline) as bill:
        if usd is not None:
            bill.settle(usd)


async def test_a_request_waits_for_money_that_others_hold_and_give_back() -> None:
    budget, answer = SharedBudget(1.0), asyncio.Event()

    async def ask() -> None:
        async with budget.holding(0.8) as bill:
            await answer.wait()
            bill.settle(0.1)

    first = asyncio.create_task(ask())
    await asyncio.sleep(0)
    second = asyncio.create_task(spend(budget, 0.5, 0.2))
    late = asyncio.create_task(spend(budget, 0.5, deadline=asyncio.get_running_loop().time()))
    with pytest.raises(LimitExceeded, match=r"0\.8000 held for requests under way"):
        await late
    answer.set()
    await asyncio.gather(first, second)
    assert budget.booked_usd == pytest.approx(0.3)


async def test_a_request_that_may_cost_more_than_is_left_is_not_made() -> None:
    budget = SharedBudget(1.0)
    await spend(budget, 0.6)
    with pytest.raises(LimitExceeded):
        await spend(budget, 0.5)


async def test_a_model_that_costs_nothing_is_asked_under_any_budget() -> None:
    await spend(SharedBudget(0.0), 0.0)


SPENDING = """
import sqlite3
import sys
from pathlib import Path
from khala_agents.llm.money import MoneyLedger, Overdrawn
ledger = MoneyLedger(Path(sys.argv[1]))
try:
    for _ in range(70):
        ledger.settle(ledger.hold("", 0.01, 1.0), 0.01)
except Overdrawn:
    pass
"""
DYING = """
import os, signal, sys
from pathlib import Path
from khala_agents.llm.money import MoneyLedger
MoneyLedger(Path(sys.argv[1])).hold("", 0.25, 1.0)
os.kill(os.getpid(), signal.SIGKILL)
"""


def start(code: str, path: Path) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-c", code, str(path)])


def test_a_ledger_that_nobody_uses_any_more_has_closed_its_file(tmp_path: Path) -> None:
    ledger = MoneyLedger(tmp_path / "match.ledger")
    ledger.pay("", 0.1)
    database = ledger._database
    assert database is not None
    del ledger
    with pytest.raises(sqlite3.ProgrammingError, match="closed"):
        database.execute("select 1")


def test_two_processes_together_never_exceed_a_budget_that_they_share(tmp_path: Path) -> None:
    path = tmp_path / "match.ledger"
    processes = [start(SPENDING, path) for _ in range(2)]
    assert [process.wait(60) for process in processes] == [0, 0]
    assert MoneyLedger(path).booked_usd() == pytest.approx(1.0)


@pytest.mark.posix
async def test_what_a_killed_process_had_sent_stays_booked(tmp_path: Path) -> None:
    path = tmp_path / "match.ledger"
    assert start(DYING, path).wait(60) == -signal.SIGKILL
    assert MoneyLedger(path).booked_usd() == pytest.approx(0.25)
    with pytest.raises(LimitExceeded):
        await spend(SharedBudget(1.0, ledger=MoneyLedger(path)), 0.8)


async def test_sides_have_accounts_of_their_own_in_one_ledger(tmp_path: Path) -> None:
    ledger = MoneyLedger(tmp_path / "match.ledger")
    blue, red = (SharedBudget(0.5, ledger=ledger, account=side) for side in ("blue", "red"))
    await spend(blue, 0.5, 0.4)
    await spend(red, 0.5)
    assert (blue.booked_usd, red.booked_usd, ledger.booked_usd()) == pytest.approx((0.4, 0.5, 0.9))


def test_a_ledger_is_a_file_of_its_owner_and_made_when_something_is_booked(tmp_path: Path) -> None:
    path = tmp_path / "match.ledger"
    ledger = MoneyLedger(path)
    assert (ledger.booked_usd(), path.exists()) == (0.0, False)
    ledger.pay("blue", 0.1)
    assert path.stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize("content", [b"", b"no database at all, but a text", b"SQLite format 3\x00" + b"\xff" * 500])
async def test_nothing_is_spent_where_it_cannot_be_noted(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "match.ledger"
    path.write_bytes(content)
    with pytest.raises(ConfigError, match="cannot be kept, and no model is asked without it"):
        await spend(SharedBudget(1.0, ledger=MoneyLedger(path)), 0.1)


@pytest.mark.parametrize(
    ("model", "address", "prompt"),
    [
        ("gpt-4o-mini", ENDPOINT, 0.15),
        ("gpt-4o", ENDPOINT, 2.5),
        ("gpt-4o-2024-08-06", ENDPOINT, 2.5),
        ("gpt-4o-2024-05-13", ENDPOINT, 5.0),
        ("gpt-4o", "https://gateway.example/v1", None),
        ("gpt-4o-mini-of-mine", ENDPOINT, None),
        ("claude-sonnet-4-5-20250929", "https://api.anthropic.com/v1", 3.0),
    ],
)
def test_a_list_price_goes_by_the_models_own_name_at_its_providers_own_address(
    model: str, address: str, prompt: float | None
) -> None:
    assert price_of(model, address).prompt == prompt


def test_all_list_prices_are_known_and_say_where_they_come_from() -> None:
    for provider in list_prices().values():
        assert provider.source.startswith("https://")
        assert all(prices.known for prices in provider.models.values())


def test_the_most_that_a_request_may_cost_has_the_dearest_price_of_a_prompt() -> None:
    prices = Prices(prompt=3.0, completion=15.0, cached=0.3, cache_write=3.75)
    assert prices.most_usd(prompt=1_000_000, completion=1_000_000) == pytest.approx(18.75)
    assert Prices(prompt=1.0).most_usd(prompt=1, completion=1) is None


def test_a_budget_without_a_price_is_refused_with_what_to_do() -> None:
    with pytest.raises(
        ConfigError, match=r"a budget needs the price of my-model at 10\.0\.0\.5:8000, and no price is known"
    ):
        check_priced(Prices(), "my-model", "http://10.0.0.5:8000/v1")
