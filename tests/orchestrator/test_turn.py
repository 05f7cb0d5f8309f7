"""Who is asked, whose reply is taken and who is waited for no longer; on a clock that jumps."""

from __future__ import annotations

import asyncio
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import pytest

from khala_orchestrator.match.turn import Question, Turn
from khala_orchestrator.roster import Roster, Seat
from khala_protocol.bus import Delivery
from khala_protocol.bus.memory import MemoryBus
from khala_protocol.codec import encode
from khala_protocol.keys import Topic
from khala_protocol.messages import Reply, Usage

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Iterator

    from khala_protocol.bus import Publisher
    from khala_protocol.bus.memory import MemoryBroker
    from tests.orchestrator.conftest import Peer, Table

    Observe = Callable[..., list[Question]]
    MakePeer = Callable[[Seat], Peer]

CLOCK = "jumps"

RUN = "test"
ZEALOTS, STALKERS = Seat("p1", "Zealots"), Seat("p1", "Stalkers")


@dataclass
class _SlowPublisher:
    publisher: Publisher

    @property
    def key(self) -> str:
        return self.publisher.key

    async def put(self, payload: bytes) -> None:
        await asyncio.sleep(2)
        await self.publisher.put(payload)

    async def close(self) -> None:
        await self.publisher.close()


class SlowBus(MemoryBus):
    """A session whose puts take two seconds."""

    async def publisher(self, key: str, delivery: Delivery) -> Publisher:
        return _SlowPublisher(await super().publisher(key, delivery))


async def test_a_step_ends_when_all_have_replied(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
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
    broker: MemoryBroker, table: Table, observe: Observe
) -> None:
    async with table(ZEALOTS) as (turn, (zealots,)):
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


async def test_the_first_valid_reply_counts_and_a_second_is_ignored(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, within_s=60)))
        await zealots.observed()
        await zealots.reply("first")
        await zealots.reply("second")
        await stalkers.reply("")
        answer = (await asked).by_seat[ZEALOTS]
    assert (answer.text, answer.ignored) == ("first", 1)


@pytest.mark.parametrize(("episode", "step"), [(0, 7), (3, 1)], ids=["of another step", "of another episode"])
async def test_a_reply_of_another_time_is_counted_and_not_taken(
    table: Table, observe: Observe, episode: int, step: int
) -> None:
    async with table(ZEALOTS) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, step=1, within_s=60)))
        await zealots.observed()
        await zealots.reply("wrong", episode=episode, step=step)
        await zealots.reply("right", step=1)
        answer = (await asked).by_seat[ZEALOTS]
    assert (answer.status, answer.text, answer.ignored) == ("ok", "right", 1)


async def test_a_late_reply_is_counted_in_the_next_step_and_not_executed(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS) as (turn, (zealots,)):
        late = (await turn.ask(observe(ZEALOTS, step=0, within_s=0.01))).by_seat[ZEALOTS]
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, step=1, within_s=60)))
        assert [(await zealots.observed()).step for _ in range(2)] == [0, 1]
        await zealots.reply("too late", step=0)
        await zealots.reply("in time", step=1)
        answer = (await asked).by_seat[ZEALOTS]
    assert (late.status, late.text) == ("late", None)
    assert (answer.text, answer.ignored) == ("in time", 1)


async def test_an_agent_that_dies_is_not_waited_for(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, within_s=60)))
        await zealots.observed()
        await zealots.reply("")
        stalkers.bus.kill()
        answers = (await asked).by_seat
    assert {seat.agent: a.status for seat, a in answers.items()} == {"Zealots": "ok", "Stalkers": "gone"}


async def test_an_agent_that_restarts_in_a_step_can_still_answer_it(
    table: Table, peer: MakePeer, observe: Observe
) -> None:
    async with table(ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, within_s=60)))
        await zealots.observed()
        stalkers.bus.kill()
        again = peer(STALKERS)
        await again.arrive("2")
        assert (await again.observed()).step == 0
        await again.reply("back")
        await zealots.reply("")
        assert (await asked).by_seat[STALKERS].text == "back"


async def test_our_own_lost_link_is_no_death_of_others(broker: MemoryBroker, peer: MakePeer, observe: Observe) -> None:
    host = broker.session()
    zealots = peer(ZEALOTS)
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
async def test_garbage_is_named_and_not_waited_for(table: Table, observe: Observe, payload: bytes, reason: str) -> None:
    async with table(ZEALOTS) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=60)))
        await zealots.observed()
        await zealots.put(Topic.REPLY, payload)
        answer = (await asked).by_seat[ZEALOTS]
    assert answer.status == "malformed"
    assert reason in answer.detail


async def test_an_agent_of_another_match_is_not_heard(table: Table, peer: MakePeer, observe: Observe) -> None:
    stranger = peer(Seat("p1", "Stranger"))
    async with table(ZEALOTS) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=60)))
        await zealots.observed()
        await stranger.reply("let me in")
        await zealots.reply("")
        answers = await asked
    assert list(answers.by_seat) == [ZEALOTS]


# --- the deadline -------------------------------------------------------------------------------------


async def test_a_reply_is_in_time_until_the_deadline_and_late_from_then_on(
    table: Table, observe: Observe, subtests: pytest.Subtests
) -> None:
    for after_s, status in ((0.0, "ok"), (9.999, "ok"), (10.0, "late"), (10.001, "late")):
        with subtests.test(after_s=after_s):
            async with table(ZEALOTS) as (turn, (zealots,)):

                async def think(zealots: Peer = zealots, after_s: float = after_s) -> None:
                    seen = await zealots.observed()
                    await asyncio.sleep(after_s)
                    await zealots.answer(seen, "done")

                thinking = asyncio.create_task(think())
                answers = await turn.ask(observe(ZEALOTS, within_s=10))
                answer = answers.by_seat[ZEALOTS]
                await thinking
            assert answer.status == status
            assert answers.wait_s == pytest.approx(min(after_s, 10.0))
            assert answer.latency_s == (pytest.approx(after_s) if status == "ok" else None)
            assert answer.detail == ("" if status == "ok" else "no reply before the deadline")


async def test_all_that_comes_in_time_counts_when_one_is_late(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS, STALKERS) as (turn, (_, stalkers)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, within_s=10)))
        await asyncio.sleep(4)
        await stalkers.reply("here")
        answers = await asked
    assert {seat: (a.status, a.text, a.latency_s) for seat, a in answers.by_seat.items()} == {
        ZEALOTS: ("late", None, None),
        STALKERS: ("ok", "here", 4.0),
    }
    assert answers.wait_s == 10


async def test_without_a_deadline_it_waits_as_long_as_it_takes(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=None)))
        await asyncio.sleep(86_400)
        await zealots.reply("at last")
        answer = (await asked).by_seat[ZEALOTS]
    assert (answer.status, answer.latency_s) == ("ok", 86_400)


async def test_the_wait_begins_when_the_last_observation_is_published(
    broker: MemoryBroker, peer: MakePeer, observe: Observe
) -> None:
    for seat in (ZEALOTS, STALKERS):
        await peer(seat).arrive()
    host = SlowBus(broker._hub)
    async with Roster(host, RUN, [ZEALOTS, STALKERS]) as roster, Turn(host, RUN, roster) as turn:
        await roster.assemble([ZEALOTS, STALKERS], 1)
        answers = await turn.ask(observe(ZEALOTS, STALKERS, within_s=10))
    assert (answers.publish_s, answers.wait_s) == (4.0, 10.0)
    assert {a.status for a in answers.by_seat.values()} == {"late"}


async def test_one_that_answers_before_the_others_are_asked_does_not_end_the_step(
    broker: MemoryBroker, peer: MakePeer, observe: Observe
) -> None:
    zealots, stalkers = peer(ZEALOTS), peer(STALKERS)
    await zealots.arrive()
    await stalkers.arrive()
    host = SlowBus(broker._hub)
    async with Roster(host, RUN, [ZEALOTS, STALKERS]) as roster, Turn(host, RUN, roster) as turn:
        await roster.assemble([ZEALOTS, STALKERS], 1)
        quick = asyncio.create_task(zealots.play(lambda peer, seen: peer.answer(seen, "quick")))
        first, second = observe(ZEALOTS, STALKERS, within_s=10)
        asked = asyncio.create_task(turn.ask([first, second._replace(pictures=[b"slow"])]))
        await stalkers.observed()
        await asyncio.sleep(3)
        await stalkers.reply("slow")
        answers = await asked
        quick.cancel()
    assert answers.wait_s == 3.0
    assert [(seat.agent, a.text, a.latency_s) for seat, a in answers.by_seat.items()] == [
        ("Zealots", "quick", 2.0),
        ("Stalkers", "slow", 7.0),
    ]


async def test_a_question_is_published_before_the_next_is_made(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
        made: list[str] = []

        def questions() -> Iterator[Question]:
            for question in observe(ZEALOTS, STALKERS, within_s=1):
                made.append(question.observation.agent)
                yield question

        asked = asyncio.create_task(turn.ask(questions()))
        assert (await zealots.observed()).agent == "Zealots"
        assert (await stalkers.observed()).agent == "Stalkers"
        await zealots.reply()
        await stalkers.reply()
        answers = await asked
    assert made == ["Zealots", "Stalkers"] == [seat.agent for seat in answers.by_seat]


# --- what is not taken --------------------------------------------------------------------------------


async def test_what_is_ignored_is_counted_for_its_agent_once(
    table: Table, observe: Observe, subtests: pytest.Subtests
) -> None:
    wrong: dict[str, dict[str, Any]] = {
        "of a step before": {"step": 0},
        "of a step to come": {"step": 2},
        "of another episode": {"episode": 1},
        "of another run": {"run": "other"},
        "of another side": {"side": "p2"},
        "of another agent": {"agent": "Stalkers"},
    }
    for name, changes in wrong.items():
        with subtests.test(name):
            async with table(ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
                asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, step=1, within_s=10)))
                await zealots.observed()
                await zealots.reply("wrong", **{"step": 1} | changes)
                await zealots.reply("right", step=1)
                await stalkers.reply("mine", step=1)
                answers = (await asked).by_seat
                assert {seat: (a.text, a.ignored) for seat, a in answers.items()} == {
                    ZEALOTS: ("right", 1),
                    STALKERS: ("mine", 0),
                }
                asked = asyncio.create_task(turn.ask(observe(ZEALOTS, step=2, within_s=10)))
                await zealots.reply(step=2)
                assert (await asked).by_seat[ZEALOTS].ignored == 0


async def test_a_reply_between_two_steps_is_counted_in_the_next(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS) as (turn, (zealots,)):
        assert (await turn.ask(observe(ZEALOTS, within_s=1))).by_seat[ZEALOTS].ignored == 0
        await zealots.reply("too late", step=0)
        await zealots.put(Topic.REPLY, b"garbage")
        await asyncio.sleep(1)
        answer = (await turn.ask(observe(ZEALOTS, step=1, within_s=1))).by_seat[ZEALOTS]
    assert (answer.status, answer.text, answer.ignored) == ("late", None, 2)


async def test_garbage_after_a_reply_changes_nothing(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, within_s=10)))
        await zealots.observed()
        await zealots.reply("mine")
        await zealots.put(Topic.REPLY, b"garbage")
        await stalkers.reply()
        answer = (await asked).by_seat[ZEALOTS]
    assert (answer.status, answer.text, answer.detail, answer.ignored) == ("ok", "mine", "", 1)


async def test_a_reply_after_garbage_is_taken_while_the_step_is_open(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, within_s=10)))
        await zealots.observed()
        await zealots.put(Topic.REPLY, b"garbage")
        await asyncio.sleep(3)
        await zealots.reply("mended")
        await stalkers.reply()
        answer = (await asked).by_seat[ZEALOTS]
    assert (answer.status, answer.text, answer.latency_s, answer.ignored) == ("ok", "mended", 3.0, 1)


async def test_a_reply_under_a_key_that_is_none_is_passed_over(
    broker: MemoryBroker, table: Table, observe: Observe, caplog: pytest.LogCaptureFixture
) -> None:
    async with table(ZEALOTS) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=10)))
        await zealots.observed()
        odd = await broker.session().publisher(f"khala/{RUN}/p1/Zea lots/reply", Delivery.SPEECH)
        await odd.put(encode(Reply(run=RUN, side="p1", agent="Zealots", episode=0, step=0, text="odd")))
        await zealots.reply("mine")
        answer = (await asked).by_seat[ZEALOTS]
    assert (answer.text, answer.ignored) == ("mine", 0)
    assert caplog.messages == ["'khala/test/p1/Zea lots/reply' is no key of this protocol"]


async def test_an_agent_of_no_seat_is_named_in_the_log(
    table: Table, peer: MakePeer, observe: Observe, caplog: pytest.LogCaptureFixture
) -> None:
    stranger = peer(Seat("p1", "Stranger"))
    async with table(ZEALOTS) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=10)))
        await stranger.reply("hear me")
        await zealots.reply()
        await asked
    assert caplog.messages == ["p1/Stranger is not in this match, and sent a reply"]


# --- who is there -------------------------------------------------------------------------------------


async def test_one_that_goes_in_the_middle_ends_its_own_wait_and_no_other(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, within_s=60)))
        await asyncio.sleep(5)
        await stalkers.leave()
        await asyncio.sleep(20)
        assert not asked.done()
        await zealots.reply("patient")
        answers = await asked
    assert answers.wait_s == 25
    assert {seat.agent: (a.status, a.detail) for seat, a in answers.by_seat.items()} == {
        "Zealots": ("ok", ""),
        "Stalkers": ("gone", "its liveliness token went away"),
    }


async def test_nobody_waits_when_all_are_gone(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS, STALKERS) as (turn, peers):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, within_s=60)))
        await asyncio.sleep(5)
        for one in peers:
            await one.leave()
        first = await asked
        second = await turn.ask(observe(ZEALOTS, STALKERS, step=1, within_s=60))
    assert (first.wait_s, second.wait_s) == (5, 0)
    assert {a.status for answers in (first, second) for a in answers.by_seat.values()} == {"gone"}


async def test_one_that_comes_back_is_asked_and_waited_for_in_the_next_step(
    table: Table, peer: MakePeer, observe: Observe
) -> None:
    async with table(ZEALOTS) as (turn, (zealots,)):
        zealots.bus.kill()
        await asyncio.sleep(1)
        assert (await turn.ask(observe(ZEALOTS, within_s=60))).by_seat[ZEALOTS].status == "gone"
        again = peer(ZEALOTS)
        await again.arrive("2")
        await asyncio.sleep(1)
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, step=1, within_s=60)))
        await asyncio.sleep(30)
        await again.reply("back", step=1)
        answer = (await asked).by_seat[ZEALOTS]
    assert (answer.status, answer.text, answer.latency_s) == ("ok", "back", 30.0)


async def test_the_reply_of_one_that_went_afterwards_counts(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, within_s=60)))
        await asyncio.sleep(1)
        await zealots.reply("my last words")
        await zealots.leave()
        await stalkers.reply()
        answer = (await asked).by_seat[ZEALOTS]
    assert (answer.status, answer.text) == ("ok", "my last words")


async def test_one_of_two_instances_may_go_and_the_agent_is_waited_for(
    table: Table, peer: MakePeer, observe: Observe
) -> None:
    async with table(ZEALOTS) as (turn, (old,)):
        new = peer(ZEALOTS)
        await new.arrive("2")
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=60)))
        await asyncio.sleep(1)
        await old.leave()
        await asyncio.sleep(1)
        assert not asked.done()
        await new.reply("I took over")
        answer = (await asked).by_seat[ZEALOTS]
    assert (answer.status, answer.text, answer.latency_s) == ("ok", "I took over", 2.0)


async def test_of_two_instances_the_first_reply_counts(table: Table, peer: MakePeer, observe: Observe) -> None:
    async with table(ZEALOTS, STALKERS) as (turn, (old, stalkers)):
        new = peer(ZEALOTS)
        await new.arrive("2")
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, within_s=60)))
        await new.observed()
        await new.reply("new")
        await old.reply("old")
        await stalkers.reply()
        answer = (await asked).by_seat[ZEALOTS]
    assert (answer.text, answer.ignored) == ("new", 1)


# --- what a reply brings ------------------------------------------------------------------------------


async def test_a_fallback_is_a_reply_that_says_why_it_is_none(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=60)))
        await zealots.observed()
        await zealots.reply("", status="fallback", detail="http 500", usage=Usage(requests=2, prompt_tokens=7))
        answer = (await asked).by_seat[ZEALOTS]
    assert (answer.status, answer.detail, answer.text) == ("fallback", "http 500", "")
    assert answer.usage == Usage(requests=2, prompt_tokens=7)


async def test_without_a_reply_there_are_no_words_and_no_usage(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS) as (turn, _):
        answer = (await turn.ask(observe(ZEALOTS, within_s=1))).by_seat[ZEALOTS]
    assert (answer.text, answer.usage) == (None, Usage())


async def test_a_turn_takes_back_what_it_declared(table: Table, broker: MemoryBroker, observe: Observe) -> None:
    async with table(ZEALOTS) as (turn, _):
        (question,) = observe(ZEALOTS, within_s=1)
        await turn.ask([question._replace(pictures=[b"picture"])])
    late = await broker.session().subscribe("**", Delivery.STATE)
    await late.close()
    assert [sample.key async for sample in late] == []


# --- required agents ------------------------------------------------------------------------------------


@asynccontextmanager
async def requiring(
    broker: MemoryBroker, peer: MakePeer, *seats: Seat, grace_s: float = 30.0
) -> AsyncIterator[tuple[Turn, list[Peer]]]:
    """A turn that cannot do without the first of its agents, all of them there."""
    peers = [peer(seat) for seat in seats]
    for one in peers:
        await one.arrive()
    host = broker.session()
    async with Roster(host, RUN, seats) as roster, Turn(host, RUN, roster, required=seats[:1], grace_s=grace_s) as turn:
        await roster.assemble(seats, 1)
        yield turn, peers


async def test_a_required_agent_that_dies_is_waited_for_and_its_successor_loses_nothing(
    broker: MemoryBroker, peer: MakePeer, observe: Observe
) -> None:
    async with requiring(broker, peer, ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, STALKERS, within_s=10)))
        await stalkers.observed()
        await stalkers.reply("")
        zealots.bus.kill()
        await asyncio.sleep(29)
        again = peer(ZEALOTS)
        await again.arrive("2")
        await again.observed()
        await asyncio.sleep(9)
        await again.reply("back")
        answers = await asked
    assert (answers.by_seat[ZEALOTS].text, answers.lost) == ("back", {})
    assert answers.incidents == ["required agent p1/Zealots was away for 29.0 s"]
    assert (answers.wait_s, answers.held_s) == (29 + 9, 29)


async def test_a_required_agent_that_does_not_come_back_is_lost(
    broker: MemoryBroker, peer: MakePeer, observe: Observe
) -> None:
    async with requiring(broker, peer, ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
        zealots.bus.kill()
        stalkers.bus.kill()
        answers = await turn.ask(observe(ZEALOTS, STALKERS, within_s=10))
        assert asyncio.get_running_loop().time() == 30
    assert {seat.agent: answer.status for seat, answer in answers.by_seat.items()} == dict.fromkeys(
        ("Zealots", "Stalkers"), "gone"
    )
    assert answers.lost == {ZEALOTS: "it went away"}
    assert answers.held_s == answers.wait_s == 30
    assert answers.incidents == ["required agent p1/Zealots did not come back within 30 s"]


async def test_one_that_is_back_and_silent_is_late_and_not_lost(
    broker: MemoryBroker, peer: MakePeer, observe: Observe
) -> None:
    async with requiring(broker, peer, ZEALOTS) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=10)))
        await asyncio.sleep(5)
        zealots.bus.kill()
        await asyncio.sleep(20)
        await peer(ZEALOTS).arrive("2")
        answers = await asked
        assert asyncio.get_running_loop().time() == 5 + 20 + 10
    assert (answers.by_seat[ZEALOTS].status, answers.lost) == ("late", {})
    assert answers.wait_s - answers.held_s == 10


async def test_a_step_is_held_for_required_agents_alone_and_not_for_what_was_before_it(
    broker: MemoryBroker, peer: MakePeer, observe: Observe
) -> None:
    async with requiring(broker, peer, ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=10)))
        await zealots.observed()
        await zealots.leave()
        await asyncio.sleep(3)
        await zealots.arrive()
        await zealots.reply()
        held = [await asked]
        await stalkers.leave()
        held.append(await turn.ask(observe(ZEALOTS, STALKERS, step=1, within_s=10)))
    assert [(answers.wait_s, answers.held_s) for answers in held] == [(3, 3), (10, 0)]


async def test_one_whose_link_is_back_is_asked_again(broker: MemoryBroker, peer: MakePeer, observe: Observe) -> None:
    async with requiring(broker, peer, ZEALOTS) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=10)))
        first = await zealots.observed()
        await zealots.leave()  # and its reply is lost on the way
        await asyncio.sleep(2)
        await zealots.arrive()
        while (await zealots.observed()) != first:
            pass
        await zealots.reply("once more")
        assert (await asked).by_seat[ZEALOTS].text == "once more"


async def test_garbage_under_the_name_of_one_that_is_away_ends_no_wait(
    broker: MemoryBroker, peer: MakePeer, observe: Observe
) -> None:
    async with requiring(broker, peer, ZEALOTS) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=10)))
        await zealots.observed()
        await zealots.leave()
        await asyncio.sleep(1)
        await zealots.put(Topic.REPLY, b"garbage")
        await asyncio.sleep(1)
        assert not asked.done()
        await zealots.reply("not of mine")
        answers = await asked
    assert (answers.by_seat[ZEALOTS].text, answers.by_seat[ZEALOTS].ignored, answers.lost) == ("not of mine", 1, {})


async def test_one_whose_return_was_not_reported_is_found_by_its_answer(
    broker: MemoryBroker, peer: MakePeer, observe: Observe
) -> None:
    async with requiring(broker, peer, ZEALOTS) as (turn, (zealots,)):
        await zealots.leave()  # its token, and not its link
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=10)))
        seen = [await zealots.observed() for _ in range(3)]
        assert asyncio.get_running_loop().time() == pytest.approx(2)
        await zealots.reply("here all the time")
        answers = await asked
    assert (answers.by_seat[ZEALOTS].text, answers.held_s) == ("here all the time", answers.wait_s)
    assert seen == [seen[0]] * 3


async def test_while_our_own_link_is_down_the_clock_stands_still(
    broker: MemoryBroker, peer: MakePeer, observe: Observe
) -> None:
    zealots, host = peer(ZEALOTS), broker.session()
    await zealots.arrive()
    async with Roster(host, RUN, [ZEALOTS]) as roster, Turn(host, RUN, roster, required=[ZEALOTS], grace_s=30) as turn:
        await roster.assemble([ZEALOTS], 1)
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=5)))
        await zealots.observed()
        host.cut()
        await asyncio.sleep(20)
        host.mend()
        await zealots.observed()
        await zealots.reply("I never left")
        answers = await asked
        assert asyncio.get_running_loop().time() == 20
    assert (answers.by_seat[ZEALOTS].text, answers.lost) == ("I never left", {})


# --- without waiting ------------------------------------------------------------------------------------


async def test_without_waiting_there_are_the_answers_that_have_arrived(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS, STALKERS) as (turn, (zealots, stalkers)):
        found = [await turn.ask(observe(ZEALOTS, STALKERS, within_s=60), wait=False)]
        await zealots.observed()
        await zealots.reply("quick")
        await asyncio.sleep(1)
        found.append(await turn.ask([], wait=False))
        await turn.ask(observe(ZEALOTS, step=1, within_s=60), wait=False)
        await stalkers.reply("slow", step=0)
        await zealots.reply("quick again", step=1)
        await asyncio.sleep(1)
        found.append(await turn.ask([], wait=False))
        found.append(await turn.ask([], wait=False))
    said = [{seat.agent: answer.text for seat, answer in answers.by_seat.items()} for answers in found]
    assert said == [{}, {"Zealots": "quick"}, {"Stalkers": "slow", "Zealots": "quick again"}, {}]


async def test_a_question_that_nobody_waits_for_has_a_deadline_all_the_same(table: Table, observe: Observe) -> None:
    async with table(ZEALOTS) as (turn, _):
        await turn.ask(observe(ZEALOTS, within_s=10), wait=False)
        await asyncio.sleep(9)
        assert not (await turn.ask([], wait=False)).by_seat
        await asyncio.sleep(1)
        assert (await turn.ask([], wait=False)).by_seat[ZEALOTS].status == "late"


async def test_an_inbox_that_fails_ends_the_match(broker: MemoryBroker, peer: MakePeer, observe: Observe) -> None:
    class Full(Exception):
        pass

    async with requiring(broker, peer, ZEALOTS) as (turn, (zealots,)):
        asked = asyncio.create_task(turn.ask(observe(ZEALOTS, within_s=60)))
        await zealots.observed()

        def fail(*_: object) -> None:
            raise Full

        turn._take_reply = fail  # type: ignore[method-assign,assignment]
        await zealots.reply("too much")
        with pytest.raises(Full):
            await asked
        with pytest.raises(Full):
            await turn.ask([], wait=False)
        turn._pump = asyncio.create_task(asyncio.sleep(0))
