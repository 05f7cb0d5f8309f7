"""A person's seat on the bus, on a clock that jumps: presence, one answer, one window."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

from khala_orchestrator.config import MatchConfig, load_task
from khala_protocol.bus import Delivery
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.codec import decode_as, encode
from khala_protocol.keys import RUN_TOPICS, Topic, agent_key, every_agent, run_key
from khala_protocol.messages import Briefing, Casualties, Observation, Reply, Result, View
from khala_sc2.playing.persons import AWAY_S, COME_S, PersonSeat, play_seat, with_persons
from khala_sc2.playing.seats import NotAsked, Seat

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from khala_protocol.bus import Liveness, Sample, Subscription
    from khala_protocol.messages import Wire

CLOCK = "jumps"
RUN = "test"
STALKERS = Seat("blue", "Stalkers")
NOTHING = Casualties(units=0, value=0)


class Host:
    """The host's part of a run with one agent, by hand."""

    def __init__(self, broker: MemoryBroker) -> None:
        self.bus = broker.session()
        self.replies: Subscription[Sample]
        self.present: Subscription[Liveness]

    async def listen(self) -> None:
        self.replies = await self.bus.subscribe(every_agent(RUN, Topic.REPLY), Delivery.SPEECH)
        self.present = await self.bus.watch(every_agent(RUN, Topic.ALIVE))

    async def say(self, message: Wire) -> None:
        topic = Topic(str(message.model_dump()["kind"]))
        key = run_key(RUN, topic) if topic in RUN_TOPICS else agent_key(RUN, *STALKERS, topic)
        publisher = await self.bus.publisher(key, Delivery.STATE)
        await publisher.put(encode(message))

    async def ask(self, step: int, within_s: float | None = 10.0) -> None:
        await self.say(
            Observation(
                run=RUN, agent="Stalkers", side="blue", episode=0, step=step, game_loop=step, answer_within_s=within_s,
                text=f"step {step}", view=View(time_s=0.0),
            )
        )  # fmt: skip

    async def reply(self) -> Reply:
        return decode_as(Reply, (await anext(self.replies)).payload)


@pytest.fixture
async def host() -> AsyncIterator[tuple[Host, PersonSeat]]:
    """A host that has briefed the agent, and the seat of a person who has not come yet."""
    broker = MemoryBroker()
    made = Host(broker)
    await made.listen()
    await made.say(Briefing(run=RUN, agent="Stalkers", side="blue", episode=0, role="You command the Stalkers."))
    seat = PersonSeat(STALKERS)
    playing = asyncio.create_task(play_seat(seat, broker.session(), RUN))
    yield made, seat
    seat.end()
    await playing


async def asked(seat: PersonSeat, step: int) -> None:
    """Wait until a step is asked."""
    while seat.question is None or seat.question.place != (0, step) or not seat.question.waits:
        await seat.news.wait()


async def test_an_answer_is_the_reply_of_the_agent_and_says_that_it_is_human(host: tuple[Host, PersonSeat]) -> None:
    bus, seat = host
    with seat.window("a"):
        await bus.ask(0)
        await asked(seat, 0)
        seat.answer("a", (0, 0), "<Stop()>")
        reply = await bus.reply()
    assert (reply.text, reply.status, reply.human, reply.usage.requests) == ("<Stop()>", "ok", True, 0)


async def test_only_the_first_answer_to_a_question_counts_and_none_after_its_time(
    host: tuple[Host, PersonSeat],
) -> None:
    bus, seat = host
    with seat.window("a"):
        with pytest.raises(NotAsked, match="nothing is asked now"):
            seat.answer("a", (0, 0), "")
        await bus.ask(0)
        await asked(seat, 0)
        seat.answer("a", (0, 0), "one")
        with pytest.raises(NotAsked, match="answered already"):
            seat.answer("a", (0, 0), "two")
        assert (await bus.reply()).text == "one"
        await bus.ask(1)
        late = await bus.reply()
        assert (late.step, late.status, late.text) == (1, "late", "")
        with pytest.raises(NotAsked, match="time for this step is over"):
            seat.answer("a", (0, 1), "too late")
        await bus.ask(2, within_s=None)
        await asked(seat, 2)
        assert seat.question is not None and seat.question.left_s is None
        with pytest.raises(NotAsked, match="time for this step is over"):
            seat.answer("a", (0, 1), "an answer to the step before")


async def test_a_person_who_leaves_is_an_agent_that_is_gone_and_comes_back_to_the_open_question(
    host: tuple[Host, PersonSeat],
) -> None:
    bus, seat = host
    loop = asyncio.get_running_loop()
    with seat.window("a"):
        assert (await anext(bus.present)).alive
        await bus.ask(0, within_s=None)
        await asked(seat, 0)
    left_s = loop.time()
    assert not (await anext(bus.present)).alive
    assert loop.time() - left_s >= AWAY_S
    with seat.window("a"):
        assert (await anext(bus.present)).alive
        await asked(seat, 0)
        seat.answer("a", (0, 0), "back")
        assert (await bus.reply()).text == "back"


async def test_a_page_that_is_loaded_again_stays_in_its_seat(host: tuple[Host, PersonSeat]) -> None:
    bus, seat = host
    with seat.window("a"):
        assert (await anext(bus.present)).alive
        await bus.ask(0, within_s=None)
        await asked(seat, 0)
        question = seat.question
    await asyncio.sleep(AWAY_S / 2)
    with seat.window("a"):
        await asyncio.sleep(2 * AWAY_S)
        assert seat.question is question and question is not None and question.waits
        assert seat.is_owner("a")


async def test_an_answer_that_the_host_asks_for_again_is_sent_again(host: tuple[Host, PersonSeat]) -> None:
    bus, seat = host
    with seat.window("a"):
        await bus.ask(0)
        await asked(seat, 0)
        seat.answer("a", (0, 0), "mine")
        assert (await bus.reply()).text == "mine"
    await asyncio.sleep(2 * AWAY_S)
    with seat.window("a"):  # a new worker finds the question of the one before
        again = await bus.reply()
    assert (again.step, again.text, again.status) == (0, "mine", "ok")


async def test_of_two_windows_one_plays_until_the_other_takes_the_seat(host: tuple[Host, PersonSeat]) -> None:
    bus, seat = host
    with seat.window("a"), seat.window("b"):
        await bus.ask(0)
        await asked(seat, 0)
        with pytest.raises(NotAsked, match="another window plays this seat"):
            seat.answer("b", (0, 0), "")
        seat.take("b")
        with pytest.raises(NotAsked, match="another window plays this seat"):
            seat.answer("a", (0, 0), "")
        seat.answer("b", (0, 0), "b")
        assert (await bus.reply()).text == "b"


async def test_a_window_that_comes_when_the_other_has_gone_plays(host: tuple[Host, PersonSeat]) -> None:
    _, seat = host
    with seat.window("a"):
        assert seat.is_owner("a")
    with seat.window("b"):
        assert seat.is_owner("b")


async def test_the_last_result_of_the_own_side_ends_the_seat(host: tuple[Host, PersonSeat]) -> None:
    bus, seat = host
    with seat.window("a"):
        assert (await anext(bus.present)).alive
        while seat.briefing is None:
            await seat.news.wait()
        for side in ("red", "blue"):
            await bus.say(
                Result(
                    run=RUN, side=side, episode=0, outcome="win", cause="enemy defeated", steps=1, game_loop=8,
                    game_s=0.4, wall_s=0.1, killed=NOTHING, lost=NOTHING, kd=None,
                )
            )  # fmt: skip
        while not seat.over:
            await seat.news.wait()
        assert [result.side for result in seat.results] == ["blue"]
        assert not (await anext(bus.present)).alive


def test_a_host_waits_longer_for_persons_and_its_card_names_them() -> None:
    config = MatchConfig(task=load_task("2s3z_pair"), run=RUN)
    assert with_persons(config, ()) is config
    with_one = with_persons(config, {STALKERS})
    assert (with_one.humans, with_one.assemble_s) == (frozenset({("blue", "Stalkers")}), COME_S)
