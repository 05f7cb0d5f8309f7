"""What a worker does on the bus, on a clock that jumps."""

from __future__ import annotations

import asyncio
import gc
import json
import logging
from typing import TYPE_CHECKING, Any

import pytest

from khala_agents.guard import Guard
from khala_agents.llm.client import LLMError, RequestRefused
from khala_agents.llm.limits import RequestLimits
from khala_agents.llm.money import SharedBudget
from khala_agents.llm.pricing import Prices
from khala_agents.llm_policy import LLMPolicy
from khala_agents.policy import Decision, FunctionPolicy, Policy
from khala_agents.scripted.players import Fixed
from khala_agents.worker import WorkerTally, run_worker, run_workers
from khala_protocol.codec import encode
from khala_protocol.errors import BusError
from khala_protocol.keys import Topic, every_agent
from khala_protocol.messages import MemoryRule, ModelCall, Reply, Usage

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable

    from khala_agents.policy import Context, Said
    from khala_protocol.bus import Delivery
    from khala_protocol.bus.memory import MemoryBroker, MemoryBus
    from khala_protocol.messages import Briefing, Observation, Result

CLOCK = "jumps"
RUN, SIDE, AGENT = "test", "blue", "Stalkers"
ATTACK = "Analysis: fire.\nActions:\n    Team Stalker-1:\n        <Attack_Unit(0x1002c0001)>\n"


class Players:
    """Workers, each on its own session; those that still run are ended."""

    def __init__(self, broker: MemoryBroker) -> None:
        self._broker = broker
        self._stop = asyncio.Event()
        self._tasks: list[asyncio.Task[WorkerTally]] = []
        self.buses: list[MemoryBus] = []

    async def start(self, policy: Policy) -> asyncio.Task[WorkerTally]:
        bus = self._broker.session()
        self.buses.append(bus)
        task = asyncio.create_task(run_worker(bus, RUN, SIDE, AGENT, policy, stop=self._stop))
        self._tasks.append(task)
        await asyncio.sleep(0.001)
        return task

    async def end(self) -> WorkerTally:
        self._stop.set()
        return (await asyncio.gather(*self._tasks))[0]


@pytest.fixture
async def players(broker: MemoryBroker) -> AsyncIterator[Players]:
    made = Players(broker)
    yield made
    await made.end()


class Slow(Policy):
    """A policy that takes a given time, and notes its cancellation."""

    def __init__(self, *times_s: float, stubborn: bool = False) -> None:
        self._times_s = list(times_s)
        self._stubborn = stubborn
        self.cancelled: list[int] = []

    async def decide(self, context: Context) -> str:
        observation = context.observation
        try:
            await asyncio.sleep(self._times_s.pop(0))
        except asyncio.CancelledError:
            self.cancelled.append(observation.step)
            if not self._stubborn:
                raise
            await asyncio.sleep(3)
        return f"step {observation.step}: {ATTACK}"


# --- answering ------------------------------------------------------------------------------------------


async def test_an_observation_is_answered_with_what_the_policy_says(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    await players.start(Fixed(ATTACK))
    await host.say(briefing())
    await host.say(observation(step=3))
    (reply,) = await host.replies(1)
    assert (reply.agent, reply.side, reply.episode, reply.step) == (AGENT, SIDE, 0, 3)
    assert (reply.status, reply.text, reply.detail) == ("ok", ATTACK, "")


async def test_a_worker_sends_a_reply_and_nothing_else(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    text = f"{ATTACK}Communications:\n    <MessageTo(Zealots, '''hold''')>\n    <ListenTo(Channel-2)>\n"
    await players.start(Fixed(text))
    await host.say(briefing())
    await host.say(observation())
    await host.replies(1)
    assert [(message.kind, message.text) for message in host.heard] == [("reply", text)]


async def test_a_worker_that_joins_late_answers_the_observation_that_is_there(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    await host.say(briefing())
    await host.say(observation(step=7))
    await players.start(Fixed(ATTACK))
    (reply,) = await host.replies(1)
    assert reply.step == 7


async def test_an_observation_waits_for_its_briefing(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    seen: list[int] = []

    async def note(told: Briefing, shown: Observation) -> str:
        seen.append(told.episode)
        return ATTACK

    await players.start(FunctionPolicy(note))
    await host.say(briefing(episode=0))
    await host.say(observation(episode=0))
    await host.replies(1)
    await host.say(observation(episode=1))  # overtakes the briefing of its episode
    await asyncio.sleep(0.1)
    assert seen == [0]
    await host.say(briefing(episode=1))
    await host.replies(2)
    assert seen == [0, 1]


async def test_the_last_briefing_serves_if_the_new_one_does_not_come(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    await players.start(Fixed(ATTACK))
    await host.say(briefing(episode=0))
    await host.say(observation(episode=1))
    (reply,) = await host.replies(1)
    assert (reply.episode, reply.status) == (1, "ok")
    assert 0.2 < reply.latency_s < 2.0  # the wait for a briefing is 0.2 s


async def test_a_step_is_decided_once_and_its_reply_sent_again_if_it_is_asked_again(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    decided: list[int] = []

    async def decide(briefing: Briefing, observation: Observation) -> str:
        decided.append(observation.step)
        return ATTACK

    await players.start(FunctionPolicy(decide))
    await host.say(briefing())
    for step in (0, 0, 1, 0, 1, 2):
        await host.say(observation(step=step))
        await asyncio.sleep(0.1)
    assert decided == [0, 1, 2]
    assert [reply.step for reply in host.of(Reply)] == [0, 0, 1, 1, 2]


async def test_a_host_that_begins_anew_is_answered_from_step_0_again(
    host: Any,
    players: Players,
    briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
) -> None:
    await players.start(Fixed(ATTACK))
    for seed in (1, 2):
        await host.say(briefing())
        await host.say(observation(step=0, text=f"seed {seed}"))
        await asyncio.sleep(0.1)
    assert [reply.step for reply in host.of(Reply)] == [0, 0]


async def test_a_host_that_goes_on_gets_the_reply_to_its_open_step_again_without_a_new_decision(
    host: Any,
    players: Players,
    briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
) -> None:
    decided: list[int] = []

    async def decide(briefing: Briefing, observation: Observation) -> str:
        decided.append(observation.step)
        return ATTACK

    await players.start(FunctionPolicy(decide))
    for steps in ((4, 5), (5, 6)):
        await host.say(briefing())
        for step in steps:
            await host.say(observation(step=step))
            await asyncio.sleep(0.1)
    assert decided == [4, 5, 6]
    assert [reply.step for reply in host.of(Reply)] == [4, 5, 5, 6]


async def test_what_is_no_observation_is_dropped_and_the_next_one_answered(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation],
    caplog: pytest.LogCaptureFixture,
) -> None:  # fmt: skip
    await players.start(Fixed(ATTACK))
    await host.say(briefing())
    for garbage in (b"", b"{", b'{"kind": "observation", "v": 9}', b"\xff"):
        await host.raw(garbage)
        await asyncio.sleep(0.01)
    await host.say(observation())
    (reply,) = await host.replies(1)
    assert reply.status == "ok"
    assert len(caplog.records) == 4


# --- deadlines --------------------------------------------------------------------------------------------


def with_broken_view(observation: Observation) -> bytes:
    fields = observation.model_dump(mode="json") | {"view": {"teams": 7}}
    return json.dumps(fields).encode()


async def test_an_observation_whose_view_is_broken_costs_its_step_and_not_the_worker(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    async def look(told: Briefing, shown: Observation) -> str:
        return f"{len(shown.view.teams)} teams"

    await players.start(FunctionPolicy(look))
    await host.say(briefing())
    await host.raw(with_broken_view(observation(step=0)))  # the first of a run, which is compared with nothing
    (first,) = await host.replies(1)
    await host.say(observation(step=1))
    (second,) = (await host.replies(2))[1:]
    assert (first.step, first.status == "ok", second.step, second.text) == (0, False, 1, "0 teams")


@pytest.mark.parametrize("broken", ["before", "after", "both"])
async def test_a_host_that_begins_anew_is_answered_although_a_view_is_broken(
    host: Any,
    players: Players,
    caplog: pytest.LogCaptureFixture,
    briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
    broken: str,
) -> None:
    await players.start(Fixed(ATTACK))
    await host.say(briefing())
    steps = {"before": observation(step=5), "after": observation(step=0)}
    for name, seen in steps.items():
        if name == "after":
            await host.say(briefing(role="of another host"))
        await host.raw(with_broken_view(seen) if broken in (name, "both") else encode(seen))
        await asyncio.sleep(0.001)
    assert [reply.step for reply in await host.replies(2)] == [5, 0]
    assert "the view of step 0 or 5 cannot be read" in caplog.text


async def test_an_empty_reply_is_sent_before_the_deadline_when_the_policy_is_late(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    policy = Slow(60.0)
    await players.start(policy)
    await host.say(briefing())
    await host.say(observation(within_s=10.0))
    (reply,) = await host.replies(1)
    assert (reply.status, reply.detail, reply.text) == ("late", "timeout", "")
    assert 9.0 < reply.latency_s < 10.0
    assert policy.cancelled == [0]


async def test_a_policy_that_will_not_be_cancelled_does_not_delay_the_empty_reply(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    await players.start(Slow(60.0, 0.5, stubborn=True))
    await host.say(briefing())
    await host.say(observation(step=0, within_s=1.0))
    await host.replies(1)
    await host.say(observation(step=1, within_s=20.0))
    first, second = await host.replies(2)
    assert (first.status, first.latency_s < 1.0) == ("late", True)
    assert second.text.startswith("step 1")
    await asyncio.sleep(10)
    assert len(host.of(Reply)) == 2, "the answer of the old request was taken for one"


async def test_without_a_deadline_a_policy_may_take_as_long_as_it_likes(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    await players.start(Slow(3600.0))
    await host.say(briefing())
    await host.say(observation(within_s=None))
    (reply,) = await host.replies(1)
    assert reply.status == "ok"
    assert reply.latency_s == pytest.approx(3600, abs=1)


async def test_no_briefing_at_all_ends_in_a_late_reply(
    host: Any, players: Players, observation: Callable[..., Observation]
) -> None:
    await players.start(Fixed(ATTACK))
    await host.say(observation(within_s=2.0))
    (reply,) = await host.replies(1)
    assert (reply.status, reply.detail) == ("late", "timeout")


async def test_a_newer_observation_supersedes_the_one_that_is_being_decided(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    policy = Slow(5.0, 1.0)
    await players.start(policy)
    await host.say(briefing())
    await host.say(observation(step=0))
    await asyncio.sleep(1.0)
    await host.say(observation(step=1))
    (reply,) = await host.replies(1)
    assert reply.step == 1
    assert policy.cancelled == [0]
    assert (await players.end()).superseded == 1


async def test_a_decision_that_fails_in_the_moment_in_which_it_is_superseded_is_not_reported_by_asyncio() -> None:
    async def decide() -> Said:
        raise ValueError("too late")

    reported: list[dict[str, Any]] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: reported.append(context))
    answering = asyncio.create_task(Guard(AGENT).within(None, decide()))
    await asyncio.sleep(0)  # it waits for the decision,
    await asyncio.sleep(0)  # which fails,
    answering.cancel()  # and is cancelled before it can look
    with pytest.raises(asyncio.CancelledError):
        await answering
    del answering
    await asyncio.sleep(0)
    gc.collect()
    assert reported == []


# --- policies that fail -----------------------------------------------------------------------------------


def _raises(error: BaseException) -> Callable[[Briefing, Observation], Awaitable[Said]]:
    async def decide(briefing: Briefing, observation: Observation) -> Said:
        raise error

    return decide


def _returns(value: Any) -> Callable[[Briefing, Observation], Awaitable[Said]]:
    async def decide(briefing: Briefing, observation: Observation) -> Said:
        return value  # type: ignore[no-any-return]  # that it is wrong is the point

    return decide


FAILURES = [
    (_raises(ValueError("no")), "ValueError"),
    (_raises(TimeoutError()), "TimeoutError"),
    (_raises(asyncio.CancelledError()), "cancelled"),
    (_raises(RequestRefused("http 400: no", status="http 400")), "http 400"),
    (_raises(LLMError("nothing left", status="budget")), "budget"),
    (_returns(None), "returned NoneType"),
    (_returns(b"text"), "returned bytes"),
]


@pytest.mark.parametrize(("decide", "detail"), FAILURES, ids=[detail for _, detail in FAILURES])
async def test_a_policy_that_fails_gives_a_failed_decision_and_the_worker_lives_on(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation],
    decide: Callable[[Briefing, Observation], Awaitable[Said]], detail: str,
) -> None:  # fmt: skip
    await players.start(FunctionPolicy(decide))
    await host.say(briefing())
    for step in range(2):
        await host.say(observation(step=step))
        await host.replies(step + 1)
    assert [(r.step, r.status, r.detail, r.text) for r in host.of(Reply)] == [
        (0, "failed", detail, ""),
        (1, "failed", detail, ""),
    ]
    assert host.of(Reply)[1].latency_s < 1.0


async def test_a_failure_of_a_policy_is_logged_once_with_its_type_and_place(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation],
    caplog: pytest.LogCaptureFixture,
) -> None:  # fmt: skip
    await players.start(FunctionPolicy(_raises(KeyError("tag"))))
    await host.say(briefing())
    for step in range(3):
        await host.say(observation(step=step))
        await host.replies(step + 1)
    (record,) = caplog.records
    assert record.levelno == logging.ERROR
    assert record.getMessage().startswith("agent Stalkers: the policy failed: KeyError: 'tag' at ")
    assert "test_worker.py:" in record.getMessage()


async def test_a_function_that_blocks_holds_nobody_up(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    import threading

    released = threading.Event()

    def block(told: Briefing, shown: Observation) -> str:
        if shown.step == 0:
            released.wait(30)
        return ATTACK

    await players.start(FunctionPolicy(block))
    await host.say(briefing())
    await host.say(observation(step=0, within_s=0.5))
    (late,) = await host.replies(1)
    await host.say(observation(step=1, within_s=None))
    released.set()
    _, reply = await host.replies(2)
    assert (late.status, late.detail) == ("late", "timeout")
    assert (reply.step, reply.status) == (1, "ok")


async def test_a_policy_may_say_itself_that_it_falls_back(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    decision = Decision("Actions:\n", "fallback", "unsure", attempts=3, usage=Usage(requests=3))
    await players.start(FunctionPolicy(_returns(decision)))
    await host.say(briefing())
    await host.say(observation())
    (reply,) = await host.replies(1)
    assert (reply.status, reply.detail, reply.attempts, reply.usage.requests) == ("fallback", "unsure", 3, 3)


@pytest.mark.parametrize(
    ("said", "sent"),
    [("\ud83d unpaired", "? unpaired"), ("x" * 100_000, "x" * 65_537), ("\x00 ünï", "\x00 ünï")],
    ids=["surrogate", "endless", "zero"],
)
async def test_a_text_that_cannot_travel_is_made_to(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation],
    said: str, sent: str,
) -> None:  # fmt: skip
    await players.start(Fixed(said))
    await host.say(briefing())
    await host.say(observation())
    (reply,) = await host.replies(1)
    assert (reply.status, reply.text) == ("ok", sent)


# --- usage of a model --------------------------------------------------------------------------------------


async def test_exchanges_are_published_and_summed_up_in_the_reply(
    host: Any, players: Players, listed_model: Any, briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
) -> None:  # fmt: skip
    await players.start(LLMPolicy(listed_model(RequestRefused("no", status="http 400"), ATTACK)))
    await host.say(briefing())
    for step in range(2):
        await host.say(observation(step=step))
        await host.replies(step + 1)
    failed, good = host.of(Reply)
    assert (failed.status, failed.attempts, failed.usage) == ("failed", 1, Usage(requests=1))
    assert (good.status, good.attempts) == ("ok", 1)
    assert good.usage == Usage(requests=1, prompt_tokens=100, completion_tokens=10, cost_usd=0.5)
    tally = await players.end()
    assert [(e.step, e.attempt, e.status, e.completion) for e in host.of(ModelCall)] == [
        (0, 1, "http 400", None),
        (1, 1, "ok", ATTACK),
    ]
    assert tally.usage.requests == 2


async def test_what_a_policy_asks_beside_its_decisions_is_counted_in_its_next_reply(
    host: Any, players: Players, listed_model: Any, briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
) -> None:  # fmt: skip
    await players.start(LLMPolicy(listed_model(ATTACK, "We attack.", ATTACK)))
    await host.say(briefing(memory=MemoryRule(summary=1)))
    for step in range(2):
        await host.say(observation(step=step))
        await host.replies(step + 1)
    assert [(reply.attempts, reply.usage.requests) for reply in host.of(Reply)] == [(1, 1), (1, 2)]
    await players.end()
    assert [(call.step, call.purpose, call.completion) for call in host.of(ModelCall)] == [
        (0, "decision", ATTACK),
        (0, "summary", "We attack."),
        (1, "decision", ATTACK),
    ]


async def test_a_request_that_the_deadline_cut_off_is_counted_as_unknown_and_not_as_nothing(
    host: Any, players: Players, listed_model: Any, briefing: Callable[..., Briefing],
    observation: Callable[..., Observation],
) -> None:  # fmt: skip
    await players.start(LLMPolicy(listed_model(60.0, "never")))
    await host.say(briefing())
    await host.say(observation(within_s=5.0))
    (reply,) = await host.replies(1)
    assert (reply.status, reply.detail, reply.attempts) == ("late", "timeout", 1)
    assert reply.usage == Usage(requests=1, unknown_requests=1)
    await players.end()
    (exchange,) = host.of(ModelCall)
    assert (exchange.status, exchange.completion) == ("cancelled", None)


async def test_an_agent_without_money_goes_on_without_decisions(
    host: Any, players: Players, listed_model: Any, briefing: Callable[..., Briefing],
    observation: Callable[..., Observation], caplog: pytest.LogCaptureFixture,
) -> None:  # fmt: skip
    model = listed_model("one", "two", "three")
    limits = RequestLimits(prices=Prices(prompt=1, completion=1), budget=SharedBudget(1.0, source="--budget-usd"))
    await players.start(LLMPolicy(model, limits=limits))
    await host.say(briefing())
    for step in range(5):
        await host.say(observation(step))
        await host.replies(step + 1)
    said = [(r.text, r.status, r.detail, r.attempts) for r in host.of(Reply)]
    assert said == [("one", "ok", "", 1), ("two", "ok", "", 1), *[("", "failed", "budget", 0)] * 3]
    assert len(model.requests) == 2
    (record,) = caplog.records
    assert "--budget-usd is 1 USD, and 1.0000 are spent" in record.getMessage()


async def test_a_policy_is_prepared_at_each_episode_and_closed_at_the_end(
    host: Any, players: Players, listed_model: Any, briefing: Callable[..., Briefing]
) -> None:
    model = listed_model()
    await players.start(LLMPolicy(model))
    for episode in (0, 0, 1):
        await host.say(briefing(episode=episode))
        await asyncio.sleep(0.01)
    assert model.refreshed == 2
    await players.end()
    assert model.closed == 1


# --- coming and going -------------------------------------------------------------------------------------


async def test_a_worker_is_alive_from_when_it_listens_until_it_ends(
    broker: MemoryBroker, host: Any, players: Players
) -> None:
    tokens = await broker.session().watch(every_agent(RUN, Topic.ALIVE))
    await players.start(Fixed(ATTACK))
    await players.start(Fixed(ATTACK))
    seen = [await anext(tokens), await anext(tokens)]
    assert all(token.alive and token.key.startswith("khala/test/blue/Stalkers/alive/") for token in seen)
    assert len({token.key for token in seen}) == 2, "two instances of an agent stay visible as two"
    await players.end()
    assert [(await anext(tokens)).alive for _ in range(2)] == [False, False]


async def test_a_worker_ends_with_the_last_result_of_the_run(
    host: Any, players: Players, briefing: Callable[..., Briefing], result: Callable[..., Result]
) -> None:
    task = await players.start(Fixed(ATTACK))
    await host.say(briefing(episodes=2))
    await host.say(result(0))
    await asyncio.sleep(1)
    assert not task.done()
    await host.say(result(1))
    assert (await task).ended == "result"


async def test_a_worker_that_comes_after_the_end_goes_again(
    host: Any, players: Players, briefing: Callable[..., Briefing], result: Callable[..., Result]
) -> None:
    await host.say(result(0))
    await host.say(briefing(episodes=1))
    task = await players.start(Fixed(ATTACK))
    assert (await task).ended == "result"


async def test_a_worker_that_is_told_to_stop_leaves_the_decision_and_answers_no_more(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    policy = Slow(5.0)
    await players.start(policy)
    await host.say(briefing())
    await host.say(observation())
    await asyncio.sleep(1)
    tally = await players.end()
    assert (tally.ended, tally.superseded, policy.cancelled) == ("stopped", 0, [0])
    assert host.of(Reply) == []


async def test_a_worker_ends_when_its_bus_is_closed(
    host: Any, players: Players, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    task = await players.start(Slow(5.0))
    await host.say(briefing())
    await host.say(observation())
    await asyncio.sleep(1)
    await players.buses[0].close()
    assert (await task).ended == "bus closed"


class FailingOnce:
    """A bus whose publishers cannot put the first time."""

    def __init__(self, bus: MemoryBus) -> None:
        self._bus = bus

    def __getattr__(self, name: str) -> Any:
        return getattr(self._bus, name)

    async def publisher(self, key: str, delivery: Delivery) -> Any:
        publisher = await self._bus.publisher(key, delivery)
        put, failed = publisher.put, False

        async def put_later(payload: bytes) -> None:
            nonlocal failed
            if not failed:
                failed = True
                raise BusError("the link is congested")
            await put(payload)

        publisher.put = put_later  # type: ignore[method-assign]  # this one publisher only
        return publisher


async def test_a_reply_that_cannot_be_sent_costs_its_step_and_not_the_worker(
    broker: MemoryBroker, host: Any, listed_model: Any, briefing: Callable[..., Briefing],
    observation: Callable[..., Observation], caplog: pytest.LogCaptureFixture,
) -> None:  # fmt: skip
    stop = asyncio.Event()
    bus: Any = FailingOnce(broker.session())
    playing = asyncio.create_task(run_worker(bus, RUN, SIDE, AGENT, LLMPolicy(listed_model("one", "two")), stop=stop))
    await host.say(briefing())
    await host.say(observation(0))
    await asyncio.sleep(1)
    await host.say(observation(1))
    await host.replies(1)
    stop.set()
    await playing
    assert [reply.step for reply in host.of(Reply)] == [exchange.step for exchange in host.of(ModelCall)] == [1]
    assert sorted(record.getMessage() for record in caplog.records) == [
        "agent Stalkers: an exchange of step 0 is lost: the link is congested",
        "agent Stalkers: the reply to step 0 could not be sent: the link is congested",
    ]


async def test_several_agents_play_in_one_process_each_with_its_own_policy(
    broker: MemoryBroker, host: Any, briefing: Callable[..., Briefing], observation: Callable[..., Observation]
) -> None:
    stop = asyncio.Event()
    policies: dict[str, Policy] = {name: Fixed(f"I am {name}") for name in ("A", "B")}
    policies["C"] = FunctionPolicy(_raises(RuntimeError("broken")))
    playing = asyncio.create_task(run_workers(broker.session(), RUN, SIDE, policies, stop=stop))
    for name in policies:
        await host.say(briefing(agent=name), agent=name)
        await host.say(observation(agent=name), agent=name)
    replies = await host.replies(3)
    assert {r.agent: r.text for r in replies} == {"A": "I am A", "B": "I am B", "C": ""}
    stop.set()
    tallies = await playing
    assert {name: dict(tally.replies) for name, tally in tallies.items()} == {
        "A": {"ok": 1},
        "B": {"ok": 1},
        "C": {"failed": 1},
    }
