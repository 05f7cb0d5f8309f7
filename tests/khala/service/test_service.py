"""The service on a bus in memory, with players that only pretend: orders, turns, lost workers, limits, the end."""

from __future__ import annotations

import asyncio
import contextlib
import io
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self

import pytest
from rich.console import Console

from khala_bridge.game.game import GameIdentity
from khala_orchestrator.config import change, load_task
from khala_orchestrator.match.cards import run_card
from khala_protocol.bus import Delivery
from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.codec import encode
from khala_protocol.errors import ConfigError
from khala_protocol.keys import Topic, run_key
from khala_protocol.messages import AgentReport, Report, Usage
from khala_protocol.recording import Recorder
from khala_protocol.service import MAX_ORDER_BYTES, MatchCard, Stop, Submit
from khala_sc2.playing.jobs import Ended
from khala_sc2.playing.matches import new
from khala_sc2.playing.minds import Minds
from khala_sc2.service import client
from khala_sc2.service.book import KEPT, Limits
from khala_sc2.service.client import NoService, Refused
from khala_sc2.service.commands import table_of
from khala_sc2.service.daemon import STARTS, Service

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

    from khala_protocol.bus import Bus
    from khala_protocol.messages import Wire
    from khala_sc2.playing.jobs import Job

CLOCK = "jumps"


class Pretender:
    """A player that plays until it is told how the match ended."""

    pid = 1

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._ended: asyncio.Future[Ended] = asyncio.get_running_loop().create_future()
        self.job: Job | None = None

    async def play(self, job: Job) -> Ended:
        self.job = job
        self._stage.playing[job.config.run] = self
        self._stage.begun.append(job.config.run)
        return await self._ended

    def end(self, state: Literal["done", "stopped", "lost"], words: str = "") -> None:
        if not self._ended.done():
            self._ended.set_result(Ended(state=state, words=words))

    def stop(self) -> None:
        self.end("stopped")

    async def close(self) -> None:
        pass


@dataclass
class Stage:
    """A service, a bus, and who plays on it."""

    out: Path
    limits: Limits = field(default_factory=Limits)
    broker: MemoryBroker = field(default_factory=MemoryBroker)
    playing: dict[str, Pretender] = field(default_factory=dict)
    begun: list[str] = field(default_factory=list)
    used_mb: int = 0
    stop: asyncio.Event = field(default_factory=asyncio.Event)
    drain_s: float = 5.0
    service: Service = field(init=False)
    _service: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        async def take() -> Pretender:
            return Pretender(self)

        self.service = service = Service(
            self.broker.session(), BusConfig(), take, self.out, self.limits, self.drain_s,
            used_mb=lambda: self.used_mb, measure=lambda _: self.used_mb // 2,
        )  # fmt: skip
        self._service = asyncio.create_task(service.run(self.stop))
        return self

    async def __aexit__(self, *_: object) -> None:
        self.stop.set()
        await self.ended()

    async def end_newest(self) -> None:
        await asyncio.sleep(1)
        self.playing[self.begun[-1]].end("done")
        await asyncio.sleep(1)

    async def ended(self) -> None:
        assert self._service is not None
        await self._service

    @property
    def bus(self) -> Bus:
        return self.broker.session()

    async def submit(self, run: str, owner: str = "", **changes: Any) -> MatchCard:
        return await client.submit(self.bus, order(run, owner, **changes))

    async def card(self, run: str) -> MatchCard:
        await asyncio.sleep(1)
        return client.find(await client.list_matches(self.bus), run)

    async def report(self, run: str, step: int) -> None:
        usage = Usage(requests=1, cost_usd=0.25)
        agent = AgentReport(agent="Stalkers", side="blue", status="ok", usage=usage)
        publisher = await self.bus.publisher(run_key(run, Topic.REPORT), Delivery.LOG)
        await publisher.put(encode(Report(run=run, episode=0, step=step, game_loop=1, agents=(agent,))))


WITH_A_COMMAND = change(load_task("simple64_eceb_terran"), opponent="guest:rm -r x").model_dump(mode="json")


def order(run: str, owner: str = "", match: dict[str, Any] | None = None, **minds: Any) -> Submit:
    config = new("2s3z_pair", run, Path("nowhere"), seed=1, episodes=1, assemble_s=60.0)
    plain = config.model_dump(mode="json", exclude={"record", "run"})
    return Submit(
        run=run, number=client.new_number(), owner=owner, match=plain | (match or {}), minds=asdict(Minds()) | minds
    )


@pytest.fixture
async def stage(tmp_path: Path) -> AsyncIterator[Stage]:
    async with Stage(tmp_path, Limits(matches=2)) as stage:
        yield stage


async def test_a_match_is_taken_played_and_listed_with_its_steps_and_its_cost(stage: Stage) -> None:
    assert (await stage.submit("first", "ann")).state in {"queued", "running"}
    await stage.report("first", 4)
    running = await stage.card("first")
    assert (running.state, running.step, running.cost_usd, running.owner) == ("running", 5, 0.25, "ann")
    stage.playing["first"].end("done")
    assert (await stage.card("first")).state == "done"


async def test_the_same_order_twice_is_one_match(stage: Stage) -> None:
    wanted = order("first")
    await client.submit(stage.bus, wanted)
    stage.playing["first"].end("done")
    assert (await client.submit(stage.bus, wanted)).number == wanted.number
    assert len((await client.list_matches(stage.bus)).matches) == len(stage.begun) == 1


async def test_owners_take_turns(stage: Stage) -> None:
    for run, owner in (("a1", "ann"), ("a2", "ann"), ("a3", "ann"), ("b1", "bob")):
        await stage.submit(run, owner)
        await asyncio.sleep(0.1)
    stage.playing["a1"].end("done")
    await asyncio.sleep(0.1)
    assert stage.begun == ["a1", "a2", "b1"]


@pytest.mark.parametrize(
    ("wanted", "because"),
    [
        ({"base_url": "http://elsewhere"}, "--base-url is for a service that was started with --trust"),
        ({"match": {"task": WITH_A_COMMAND}}, "the code 'rm -r x' is for a service"),
        ({"policy": "os:system"}, "the code 'os' is for a service that was started with --trust"),
        ({"fallback": "os:system"}, "the code 'os' is for a service"),
        ({"model": "/etc/model.yaml"}, "a model file is for a service"),
        ({"model": "no-such"}, "there is no model file 'no-such'"),
        ({"colour": "red"}, "there is no option 'colour'"),
        ({"match": {"episodes": 0}}, "episodes: "),
    ],
    ids=str,
)
async def test_what_cannot_or_may_not_be_played_is_refused_in_a_sentence(
    stage: Stage, wanted: dict[str, Any], because: str
) -> None:
    with pytest.raises(Refused, match=because):
        await stage.submit("first", **wanted)
    assert stage.begun == []


async def test_each_side_may_have_its_own_model_and_half_of_the_budget(stage: Stage) -> None:
    duel = new("duel_3m", "duel", Path("nowhere"), seed=1, episodes=1, assemble_s=60.0)
    plain = duel.model_dump(mode="json", exclude={"record", "run"})
    wanted = order("duel", match=plain, budget_usd=3.0).but(sides={"red": "scripted/skilled"})
    await client.submit(stage.bus, wanted)
    await asyncio.sleep(1)
    job = stage.playing["duel"].job
    assert job is not None
    found = {side: (mind.model_name, mind.budget_usd) for side, mind in job.minds.items()}
    assert found == {"blue": (None, 1.5), "red": ("skilled", 1.5)}
    for sides, because in (({"green": "openai"}, "has no side green"), ({"red": "os:system"}, "is for a service")):
        with pytest.raises(Refused, match=because):
            await client.submit(stage.bus, wanted.but(run="other", number=client.new_number(), sides=sides))


async def test_a_match_is_gone_on_with_from_its_recording(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[object] = []

    async def to_thread(function: Callable[[], object]) -> object:
        read.append(function)  # no real thread: the clock would jump ahead of it
        return function()

    monkeypatch.setattr(asyncio, "to_thread", to_thread)
    config = new("2s3z_pair", "first", Path("nowhere"), seed=7, episodes=1, assemble_s=60.0)
    card = run_card(config.model_copy(update={"game": "Khala simulator"}), GameIdentity("", "", "", ""))
    wanted = order("first").but(match={}, resume=True)
    with pytest.raises(Refused, match="the service has no run 'first' to resume: it looks for its recording in"):
        await client.submit(stage.bus, wanted)
    with Recorder(stage.out / "first" / "recording.mcap") as recorder:
        recorder.write(run_key("first", Topic.RUN), encode(card))
    await client.submit(stage.bus, wanted.but(number=client.new_number()))
    await asyncio.sleep(1)
    job = stage.playing["first"].job
    assert job is not None
    assert (job.beginning, job.config.seed, job.directory) == (stage.out / "first", 7, stage.out / "first")
    assert len(read) == 2
    stage.playing["first"].end("done")
    (stage.out / "first").rename(stage.out / "second")
    with pytest.raises(Refused, match="is of the run 'first'"):
        await client.submit(stage.bus, wanted.but(run="second", number=client.new_number()))


async def test_a_name_that_cannot_be_one_is_refused_and_not_listed_at_length(stage: Stage) -> None:
    wanted = order("first").model_copy(update={"run": "x/" * 10_000})
    with pytest.raises(Refused, match="cannot stand in a key"):
        await client.submit(stage.bus, wanted)
    assert len((await client.list_matches(stage.bus)).matches[0].run) == 64


async def test_an_order_that_breaks_the_reader_is_refused_and_the_service_goes_on(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as broken:
        broken.setattr("khala_sc2.service.daemon.match_of", _breaks)
        with pytest.raises(Refused, match="the service could not read it: RecursionError"):
            await stage.submit("first")
    assert (await stage.submit("second")).state in {"queued", "running"}


def _breaks(*_: object, **__: object) -> None:
    raise RecursionError


async def test_a_flood_of_names_has_one_turn_and_one_part_of_the_queue(tmp_path: Path) -> None:
    async with Stage(tmp_path, Limits(matches=1, queued=20)) as stage:
        await stage.submit("known", "ann")
        await asyncio.sleep(1)
        for number in range(40):
            with contextlib.suppress(Refused):
                await stage.submit(f"flood-{number}", f"owner-{number}")
        with pytest.raises(Refused, match="10 matches of owners that this service has not played for yet are waiting"):
            await stage.submit("more", "another")
        for run in ("a1", "a2"):
            assert (await stage.submit(run, "ann")).state == "queued"
        for _ in range(4):
            await stage.end_newest()
        assert stage.begun == ["known", "flood-0", "a1", "flood-1", "a2"]


async def test_one_owner_leaves_places_for_others(tmp_path: Path) -> None:
    async with Stage(tmp_path, Limits(matches=1, queued=4)) as stage:
        for run in ("a0", "b0"):
            await stage.submit(run, run[0])
        await stage.end_newest()  # both are known now
        for run in ("a1", "a2"):
            await stage.submit(run, "a")
        with pytest.raises(
            Refused, match="2 matches of a are waiting already, and the other places are kept for others"
        ):
            await stage.submit("a3", "a")
        assert (await stage.submit("b1", "b")).state == "queued"


async def test_refused_orders_do_not_push_out_what_was_played(tmp_path: Path) -> None:
    async with Stage(tmp_path) as stage:
        await stage.submit("played")
        await stage.end_newest()
        for number in range(2 * KEPT):
            stage.service.book.refuse(order(f"flood-{number}"), "no place")
        assert (await stage.card("played")).state == "done"
        assert len((await client.list_matches(stage.bus)).matches) == KEPT + 1


async def test_a_name_that_is_in_use_and_a_full_queue_are_refused(tmp_path: Path) -> None:
    async with Stage(tmp_path, Limits(matches=1, queued=1)) as stage:
        await stage.submit("first")
        with pytest.raises(Refused, match="a match called first is running already: give another --run"):
            await stage.submit("first")
        await stage.submit("second")
        with pytest.raises(Refused, match="1 matches are waiting already"):
            await stage.submit("third")


async def test_bytes_that_are_no_order_change_nothing(stage: Stage) -> None:
    for payload in (b"", b"{}", b"x" * (MAX_ORDER_BYTES + 1), encode(Stop(run="first", number="other"))):
        publisher = await stage.bus.publisher("khala/service/order/mine", Delivery.SPEECH)
        await publisher.put(payload)
    assert (await client.list_matches(stage.bus)).matches == ()


async def test_a_match_is_stopped_while_it_waits_and_while_it_plays(stage: Stage) -> None:
    for run in ("first", "second", "third"):
        await stage.submit(run)
    await stage.report("first", 4)
    waiting = await client.stop(stage.bus, Stop(run="third", number=client.new_number()))
    assert (waiting.state, waiting.reason) == ("stopped", "stopped by an order")
    card = await client.stop(stage.bus, Stop(run="first", number=client.new_number()))
    assert card.state == "stopped"
    assert card.reason == "stopped by an order; `khala submit --resume first` goes on"
    with pytest.raises(ConfigError, match="the service has no match 'fourth'; its newest are first, second, third"):
        await client.stop(stage.bus, Stop(run="fourth", number=client.new_number()))


async def test_the_match_of_a_lost_worker_goes_on_in_another_and_touches_no_other(stage: Stage) -> None:
    await stage.submit("first")
    await stage.submit("second")
    await stage.report("first", 4)
    await asyncio.sleep(1)
    lost, other = stage.playing["first"], stage.playing["second"]
    lost.end("lost", "its process ended with SIGKILL")
    await asyncio.sleep(1)
    assert stage.playing["first"].job is not None
    assert stage.playing["first"].job.beginning == stage.out / "first"
    assert (await stage.card("first")).starts == 2
    assert stage.playing["second"] is other


async def test_a_match_that_loses_every_worker_has_failed(stage: Stage) -> None:
    await stage.submit("first")
    for _ in range(STARTS):
        await asyncio.sleep(0.1)
        stage.playing.pop("first").end("lost", "its process ended with SIGSEGV")
    card = await stage.card("first")
    assert (card.state, card.reason) == ("failed", "its process ended with SIGSEGV, 3 times")


async def test_a_match_waits_for_memory_and_the_largest_ends_when_it_is_used_up(tmp_path: Path) -> None:
    async with Stage(tmp_path, Limits(matches=2, memory_mb=1000)) as stage:
        stage.used_mb = 600
        await stage.submit("first")
        await stage.submit("second")
        await asyncio.sleep(5)
        assert stage.begun == ["first"]
        stage.used_mb = 1200
        await asyncio.sleep(5)
        card = await stage.card("first")
        assert card.state == "failed"
        assert card.reason.startswith("it had 600 MB when all had 1200 of 1000 MB (--memory-gb)")


async def test_at_the_end_the_running_match_may_finish_and_the_waiting_one_does_not_begin(tmp_path: Path) -> None:
    async with Stage(tmp_path, Limits(matches=1)) as stage:
        await stage.submit("first")
        await stage.submit("second")
        seen = asyncio.create_task(client.watch(stage.bus, "first", lambda _: None))
        stage.stop.set()
        await asyncio.sleep(1)
        waiting = await stage.card("second")
        assert (waiting.state, waiting.reason) == ("stopped", "the service ended before its turn came")
        with pytest.raises(Refused, match="the service is ending, and takes no more matches"):
            await stage.submit("third")
        stage.playing["first"].end("done")
        assert (await seen).state == "done"
        await stage.ended()


async def test_a_match_that_does_not_end_is_stopped_when_the_time_for_it_is_over(tmp_path: Path) -> None:
    async with Stage(tmp_path, drain_s=30) as stage:
        await stage.submit("first")
        seen = asyncio.create_task(client.watch(stage.bus, "first", lambda _: None))
        began_s = asyncio.get_running_loop().time()
        stage.stop.set()
        await stage.ended()
        assert 30 <= asyncio.get_running_loop().time() - began_s < 40
        assert (await seen).reason == "the service ended"


async def test_who_watches_sees_the_reports_until_the_match_is_over(stage: Stage) -> None:
    await stage.submit("first")
    seen: list[Wire] = []
    watching = asyncio.create_task(client.watch(stage.bus, "first", seen.append))
    await asyncio.sleep(0.1)
    await stage.report("first", 0)
    stage.playing["first"].end("done")
    assert (await watching).state == "done"
    assert [type(message) for message in seen] == [Report]


async def test_without_a_service_the_client_says_so() -> None:
    with pytest.raises(NoService, match="no service answers here within 15 s: `khala serve` starts one"):
        await client.list_matches(MemoryBroker().session())


def test_a_narrow_table_of_matches_keeps_the_names_of_tasks_whole() -> None:
    task = "simple64_sceb_terran"
    run = f"{task}-20260101-120000-ab12"
    card = MatchCard(run=run, number="1", owner="someone", task=task, state="running", episodes=20, step=900)
    printed = io.StringIO()
    Console(width=80, file=printed).print(table_of([card]))
    lines = printed.getvalue().splitlines()
    assert any(task in line.split() for line in lines[1:])
    assert max(map(len, lines)) <= 80
