"""Limits that agents share: how long each agent waits, and what is refused."""

from __future__ import annotations

import asyncio

import pytest

from khala_agents.llm.client import LimitExceeded
from khala_agents.llm.limits import LimitRules, RequestLimits, Turns
from khala_agents.llm.money import SharedBudget
from khala_agents.llm.pricing import Prices
from khala_protocol.messages import Usage

CLOCK = "jumps"
PRICES = Prices(prompt=1000.0, completion=2000.0)  # a thousandth and two of a dollar a token
ONE = Usage(requests=1, prompt_tokens=100, completion_tokens=100, cost_usd=0.3)


async def use(
    limits: RequestLimits,
    *,
    tokens: int = 100,
    takes_s: float = 0.0,
    usage: Usage | None = ONE,
    deadline: float | None = None,
) -> float:
    """Make one request; return when it was admitted."""
    async with limits.admit(tokens=tokens, answer_tokens=100, deadline=deadline) as ticket:
        admitted = asyncio.get_running_loop().time()
        await asyncio.sleep(takes_s)
        if usage:
            ticket.settle(usage)
    return admitted


async def test_no_more_requests_are_in_flight_than_allowed_and_the_first_come_goes_first() -> None:
    limits = RequestLimits(LimitRules(in_flight=2))
    assert await asyncio.gather(*(use(limits, takes_s=1) for _ in range(5))) == [0, 0, 1, 1, 2]


async def test_a_place_is_given_back_by_a_request_that_fails_or_is_cancelled() -> None:
    limits = RequestLimits(LimitRules(in_flight=1))
    with pytest.raises(ZeroDivisionError):
        async with limits.admit(tokens=1, answer_tokens=None, deadline=None):
            _ = 1 / 0
    stuck = asyncio.create_task(use(limits, takes_s=1000))
    waiting = asyncio.create_task(use(limits))
    await asyncio.sleep(1)
    waiting.cancel()
    stuck.cancel()
    await asyncio.gather(stuck, waiting, return_exceptions=True)
    assert await use(limits) == 1


async def test_a_minutes_worth_of_requests_goes_at_once_and_the_rest_evenly() -> None:
    limits = RequestLimits(LimitRules(requests_per_minute=6))
    assert await asyncio.gather(*(use(limits) for _ in range(9))) == [0, 0, 0, 0, 0, 0, 10, 20, 30]
    await asyncio.sleep(600)
    admitted = await asyncio.gather(*(use(limits) for _ in range(7)))
    assert [at - admitted[0] for at in admitted] == [0, 0, 0, 0, 0, 0, 10]


async def test_tokens_are_counted_as_estimated_and_corrected_by_what_was_used() -> None:
    limits = RequestLimits(LimitRules(tokens_per_minute=600))
    await use(limits, tokens=100)  # 100 were estimated, 200 used
    assert await use(limits, tokens=500) == 10, "600 - 200 were left, and 10 flow in each second"


async def test_a_request_that_nobody_settled_counts_with_the_most_that_it_may_cost() -> None:
    limits = RequestLimits(LimitRules(tokens_per_minute=600), prices=PRICES, budget=(budget := SharedBudget(10.0)))
    await use(limits, tokens=300, usage=None)
    assert budget.booked_usd == pytest.approx(2 * 0.3 + 0.2), "twice the estimated prompt, and the longest answer"
    assert await use(limits, tokens=600) == 30


async def test_a_turn_that_would_come_after_the_deadline_is_refused_at_once_and_costs_no_turn() -> None:
    limits = RequestLimits(LimitRules(requests_per_minute=1))
    await use(limits)
    for _ in range(2):
        with pytest.raises(LimitExceeded):
            await use(limits, deadline=30)
    with pytest.raises(LimitExceeded) as caught:
        await use(limits, deadline=30)
    assert (caught.value.type, caught.value.limit, caught.value.value) == ("requests_per_minute", 1, 2)
    assert await use(limits, deadline=61) == 60


async def test_who_stops_waiting_gives_its_turn_to_the_next() -> None:
    limits = RequestLimits(LimitRules(requests_per_minute=1, tokens_per_minute=6000))
    await use(limits)
    impatient = asyncio.create_task(use(limits))
    await asyncio.sleep(10)
    impatient.cancel()
    await asyncio.gather(impatient, return_exceptions=True)
    assert await use(limits) == 60


async def test_the_request_is_given_back_when_there_are_no_tokens_for_it() -> None:
    limits = RequestLimits(LimitRules(requests_per_minute=2, tokens_per_minute=100))
    await use(limits, usage=Usage(requests=1, prompt_tokens=100, completion_tokens=0))
    with pytest.raises(LimitExceeded, match="tokens_per_minute"):
        await use(limits, deadline=1)
    assert await use(limits, tokens=0, deadline=1) == 0


async def test_nothing_is_asked_when_the_money_is_used_up() -> None:
    budget = SharedBudget(0.85, source="the budget of this process")
    limits = RequestLimits(prices=PRICES, budget=budget)
    await use(limits)
    await use(limits)
    with pytest.raises(LimitExceeded) as caught:
        await use(limits)
    error = caught.value
    assert (error.type, error.limit, error.source) == ("budget_usd", 0.85, "the budget of this process")
    assert error.value == pytest.approx(0.6 + 1.15 * 0.1 + 0.2)
    assert (error.status, error.retryable) == ("budget", False)
    assert str(error) == (
        "the budget of this process is 0.85 USD, of which 0.6000 are spent and 0.0000 held for requests under way: the "
        "next request may cost 0.3150"
    )


async def test_who_waited_while_the_money_went_is_refused_too() -> None:
    limits = RequestLimits(LimitRules(in_flight=1), prices=PRICES, budget=SharedBudget(0.4))
    outcomes = await asyncio.gather(use(limits, takes_s=1), use(limits), return_exceptions=True)
    assert outcomes[0] == 0
    assert isinstance(outcomes[1], LimitExceeded)


async def test_requests_in_flight_hold_the_most_that_they_may_cost() -> None:
    budget = SharedBudget(1.0)
    limits = RequestLimits(prices=PRICES, budget=budget)
    outcomes = await asyncio.gather(*(use(limits, takes_s=1) for _ in range(9)), return_exceptions=True)
    assert [isinstance(outcome, LimitExceeded) for outcome in outcomes] == [False] * 3 + [True] * 6
    assert budget.booked_usd == pytest.approx(0.9)


async def test_a_prompt_is_held_as_the_endpoint_counts_once_it_has_counted_one() -> None:
    limits = RequestLimits(prices=PRICES, budget=(budget := SharedBudget(10.0)))
    await use(limits, usage=Usage(requests=1, prompt_tokens=120, completion_tokens=0, cost_usd=0.12))
    async with limits.admit(tokens=100, answer_tokens=100, deadline=None) as ticket:
        assert ticket.most_usd == pytest.approx(1.15 * 0.12 + 0.2)
        assert budget.booked_usd == pytest.approx(0.12 + 1.15 * 0.12 + 0.2)


async def test_a_budget_is_shared_by_endpoints_and_a_rate_is_not() -> None:
    budget = SharedBudget(0.3)
    first = RequestLimits(LimitRules(requests_per_minute=1), prices=PRICES, budget=budget)
    second = RequestLimits(LimitRules(requests_per_minute=1), prices=PRICES, budget=budget)
    assert await use(first, tokens=10) == 0
    with pytest.raises(LimitExceeded, match=r"the budget is 0\.3 USD, and 0\.3000 are spent"):
        await use(second)


@pytest.mark.parametrize(
    ("prices", "cost"),
    [
        (Prices(), None),
        (Prices(prompt=1), None),
        (Prices(prompt=1, completion=4), 0.0018),
        (Prices(prompt=1, completion=4, cached=0.1), 0.00144),
        (Prices(prompt=0, completion=0), 0.0),
    ],
)
def test_a_price_is_known_only_if_all_of_it_is(prices: Prices, cost: float | None) -> None:
    found = prices.cost_usd(prompt=1000, completion=200, cached=400)
    assert found == (None if cost is None else pytest.approx(cost))


# --- a gate that several have ---------------------------------------------------------------------------


async def test_limits_with_the_same_gate_let_no_more_through_together_than_one_would() -> None:
    gate = Turns(LimitRules(requests_per_minute=6, in_flight=6))
    mine, yours = RequestLimits(gate=gate), RequestLimits(gate=gate)
    admitted = await asyncio.gather(*(use(limits) for _ in range(4) for limits in (mine, yours)))
    assert admitted == [0, 0, 0, 0, 0, 0, 10, 20]


async def test_a_place_that_was_given_back_is_not_given_back_once_more() -> None:
    gate = Turns(LimitRules(in_flight=1, tokens_per_minute=600))
    place = await gate.enter(600, None)
    for _ in range(2):
        gate.leave(place, -300)
    await gate.enter(400, None)
    assert asyncio.get_running_loop().time() == 10, "300 came back once, 10 flow in each second"
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(1):
            await gate.enter(0, None)
