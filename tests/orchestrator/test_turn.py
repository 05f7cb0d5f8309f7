from __future__ import annotations

import asyncio
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

import pytest

from khala_orchestrator.roster import MissingAgents, Roster, Seat
from khala_orchestrator.turn import Question, Turn
from khala_protocol.bus import Delivery
from khala_protocol.codec import decode_as, encode
from khala_protocol.keys import Topic, agent_key, alive_key
from khala_protocol.messages import Observation, Reply

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

    from khala_protocol.bus.memory import MemoryBroker, MemoryBus

    Observe = Callable[..., list[Question]]

RUN = "test"
ZEALOTS, STALKERS = Seat("p1", "Zealots"), Seat("p1", "Stalkers")


class Peer:
    """An agent that says what a test tells it to, when the test tells it to."""

    def __init__(self, bus: MemoryBus, seat: Seat) -> None:
        self.bus, self.seat = bus, seat

    async def arrive(self, instance: str = "1") -> None:
        key = agent_key(RUN, *self.seat, Topic.OBSERVATION)
        self._observations = await self.bus.subscribe(key, Delivery.STATE)
        await self.bus.announce(alive_key(RUN, *self.seat, instance))

    async def observed(self) -> Observation:
        return decode_as(Observation, (await anext(self._observations)).payload)

    async def put(self, topic: Topic, payload: bytes) -> None:
        publisher = await self.bus.publisher(agent_key(RUN, *self.seat, topic), Delivery.SPEECH)
        await publisher.put(payload)

    async def reply(
        self, text: str, *, step: int = 0, episode: int = 0, run: str = RUN, agent: str | None = None
    ) -> None:
        side, name = self.seat
        said = Reply(run=run, side=side, agent=agent or name, episode=episode, step=step, text=text)
        await self.put(Topic.REPLY, encode(said))


@asynccontextmanager
async def table(broker: MemoryBroker, *seats: Seat) -> AsyncIterator[tuple[Turn, list[Peer]]]:
    host = broker.session()
    peers = [Peer(broker.session(), seat) for seat in seats]
    for peer in peers:
        await peer.arrive()
    async with Roster(host, RUN, seats) as roster, Turn(host, RUN, roster) as turn:
        await roster.assemble(seats, 1)
        yield turn, peers


async def test_a_step_ends_when_all_have_replied(broker: MemoryBroker, observe: Observe) -> None:
    async with table(broker, ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, within_s=60)))
        assert (await zealots.observed()).agent == "Zealots"
        await zealots.reply("for Aiur")
        assert not asked.done()
        await stalkers.reply("here in the shadows")
        answers = (await asked).by_seat
    assert {seat: (a.status, a.text) for seat, a in answers.items()} == {
        ZEALOTS: ("ok", "for Aiur"),
        STALKERS: ("ok", "here in the shadows"),
    }


async def test_pictures_are_published_before_the_observation_that_names_them(
    broker: MemoryBroker, observe: Observe
) -> None:
    async with table(broker, ZEALOTS) as (turn, (zealots,)):
        heard = await broker.session().subscribe("**", Delivery.STATE)
        for step, pictures in enumerate(([b"one", b"two"], [b"three"], [])):
            (question,) = observe(ZEALOTS, step=step, within_s=60)
            asked = asyncio.create_task(turn.ask([question._replace(pictures=pictures)]))
            await zealots.observed()
            await zealots.reply("seen", step=step)
            await asked
        samples = [await anext(heard) for _ in range(6 + 3)]
    root = f"khala/{RUN}/p1/Zealots"
    said = [(s.key.removeprefix(f"{root}/"), s.payload) for s in samples if not s.key.endswith("/reply")]
    assert [(key, payload if key.startswith("image") else b"") for key, payload in said] == [
        ("image/0", b"one"),
        ("image/1", b"two"),
        ("observation", b""),
        ("image/0", b"three"),
        ("observation", b""),
        ("observation", b""),
    ]


async def test_the_first_valid_reply_counts_and_a_second_is_ignored(broker: MemoryBroker, observe: Observe) -> None:
    async with table(broker, ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, within_s=60)))
        await zealots.observed()
        await zealots.reply("first")
        await zealots.reply("second")
        await stalkers.reply("")
        answer = (await asked).by_seat[ZEALOTS]
    assert (answer.text, answer.ignored) == ("first", 1)


@pytest.mark.parametrize(("episode", "step"), [(0, 7), (3, 1)], ids=["of another step", "of another episode"])
async def test_a_reply_of_another_time_is_counted_and_not_taken(
    broker: MemoryBroker, observe: Observe, episode: int, step: int
) -> None:
    async with table(broker, ZEALOTS) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, step=1, within_s=60)))
        await zealots.observed()
        await zealots.reply("wrong", episode=episode, step=step)
        await zealots.reply("right", step=1)
        answer = (await asked).by_seat[ZEALOTS]
    assert (answer.status, answer.text, answer.ignored) == ("ok", "right", 1)


async def test_a_late_reply_is_counted_in_the_next_step_and_not_executed(
    broker: MemoryBroker, observe: Observe
) -> None:
    async with table(broker, ZEALOTS) as (turn, (zealots,)):
        late = (await turn.ask(observe(ZEALOTS, step=0, within_s=0.01))).by_seat[ZEALOTS]
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, step=1, within_s=60)))
        assert [(await zealots.observed()).step for _ in range(2)] == [0, 1]
        await zealots.reply("too late", step=0)
        await zealots.reply("in time", step=1)
        answer = (await asked).by_seat[ZEALOTS]
    assert (late.status, late.text) == ("late", None)
    assert (answer.text, answer.ignored) == ("in time", 1)


async def test_an_agent_that_dies_is_not_waited_for(broker: MemoryBroker, observe: Observe) -> None:
    async with table(broker, ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, within_s=60)))
        await zealots.observed()
        await zealots.reply("")
        stalkers.bus.kill()
        answers = (await asked).by_seat
    assert {seat.agent: a.status for seat, a in answers.items()} == {"Zealots": "ok", "Stalkers": "gone"}


async def test_an_agent_that_restarts_in_a_step_can_still_answer_it(broker: MemoryBroker, observe: Observe) -> None:
    async with table(broker, ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, within_s=60)))
        await zealots.observed()
        stalkers.bus.kill()
        again = Peer(broker.session(), STALKERS)
        await again.arrive("2")
        assert (await again.observed()).step == 0
        await again.reply("back")
        await zealots.reply("")
        assert (await asked).by_seat[STALKERS].text == "back"


async def test_our_own_lost_link_is_no_death_of_others(broker: MemoryBroker, observe: Observe) -> None:
    host = broker.session()
    zealots = Peer(broker.session(), ZEALOTS)
    await zealots.arrive()
    async with Roster(host, RUN, [ZEALOTS]) as roster, Turn(host, RUN, roster) as turn:
        await roster.assemble([ZEALOTS], 1)
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=60)))
        await zealots.observed()
        host.cut()
        await asyncio.sleep(0)
        assert not asked.done()
        host.mend()
        await zealots.reply("still here")
        assert (await asked).by_seat[ZEALOTS].text == "still here"


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        (b"\xff\xfe garbage", "no JSON object"),
        (b'{"v": 9}', "version 9"),
        (b'{"kind": "reply"}', "Field required"),
        (encode(Reply(run="other", side="p1", agent="Zealots", episode=0, step=0, text="")), "under the key of"),
        (encode(Reply(run=RUN, side="p1", agent="Stalkers", episode=0, step=0, text="")), "under the key of"),
    ],
)
async def test_garbage_is_named_and_not_waited_for(
    broker: MemoryBroker, observe: Observe, payload: bytes, reason: str
) -> None:
    async with table(broker, ZEALOTS) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=60)))
        await zealots.observed()
        await zealots.put(Topic.REPLY, payload)
        answer = (await asked).by_seat[ZEALOTS]
    assert answer.status == "malformed"
    assert reason in answer.detail


async def test_an_agent_of_another_match_is_not_heard(broker: MemoryBroker, observe: Observe) -> None:
    stranger = Peer(broker.session(), Seat("p1", "Stranger"))
    async with table(broker, ZEALOTS) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=60)))
        await zealots.observed()
        await stranger.reply("let me in")
        await zealots.reply("")
        answers = await asked
    assert list(answers.by_seat) == [ZEALOTS]


async def test_missing_agents_are_named(broker: MemoryBroker) -> None:
    async with Roster(broker.session(), RUN, [ZEALOTS, STALKERS]) as roster:
        await Peer(broker.session(), ZEALOTS).arrive()
        with pytest.raises(
            MissingAgents, match=r"no agent took the place of p1/Stalkers within 0\.01 s: start one with"
        ):
            await roster.assemble([ZEALOTS, STALKERS], 0.01)
