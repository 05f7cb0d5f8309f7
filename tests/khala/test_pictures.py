"""Pictures from a host to an agent and into a recording, on every bus, and back out of the recording."""

from __future__ import annotations

import asyncio
import hashlib
from typing import TYPE_CHECKING, Any

import pytest

from khala_agents.policy import Policy
from khala_agents.replay import replay_agent
from khala_agents.worker import run_worker
from khala_orchestrator.match.turn import Question, Turn
from khala_orchestrator.past.transcript import StepSelection, save_pictures, summary, transcript
from khala_orchestrator.publish.record import RecordingBus
from khala_orchestrator.roster import Roster, Seat
from khala_protocol.bus import Delivery
from khala_protocol.bus.config import BusConfig
from khala_protocol.bus.memory import MemoryBroker
from khala_protocol.bus.zenoh import ZenohBus, open_bus
from khala_protocol.codec import encode
from khala_protocol.errors import RecordingError
from khala_protocol.keys import Topic, agent_key, run_key
from khala_protocol.messages import AgentCard, Briefing, Clock, ImageRef, Observation, Run, View
from khala_protocol.recording import Recorder, Recording

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
    from pathlib import Path

    from khala_agents.policy import Context
    from khala_protocol.bus import Bus

    Connect = Callable[[], Awaitable[Bus]]

RUN, SEAT = "pictures", Seat("blue", "Stalkers")
BIG = bytes(range(256)) * 400  # as large as a picture is
STEPS: tuple[list[bytes], ...] = ([b"one", BIG], [b"three", BIG], [])


@pytest.fixture(params=["memory", "zenoh"])
async def connect(request: pytest.FixtureRequest) -> AsyncIterator[Connect]:
    """Open sessions on one bus; the first one is the host's."""
    broker, opened = MemoryBroker(), list[ZenohBus]()

    async def open_one() -> Bus:
        if request.param == "memory":
            return broker.session()
        client = BusConfig(connect=opened[0].endpoints) if opened else None
        opened.append(await open_bus(client or BusConfig(mode="router", listen=("tcp/127.0.0.1:0",))))
        return opened[-1]

    yield open_one
    for session in reversed(opened):
        await session.close()


class Looking(Policy):
    """A policy that answers with the hashes of its pictures."""

    def __init__(self) -> None:
        self.seen: list[Mapping[str, bytes]] = []

    async def decide(self, context: Context) -> str:
        found = await context.pictures.get(context.observation.images, within_s=5)
        self.seen.append(found)
        return " ".join(sorted(found))


def question(step: int) -> Question:
    refs = tuple(
        ImageRef(
            name=f"screen-{place}",
            media_type="image/png",
            sha256=hashlib.sha256(data).hexdigest(),
            title=f"Screen {place}.",
            width=512,
            height=512,
            bytes=len(data),
        )
        for place, data in enumerate(STEPS[step])
    )
    shown = Observation(
        run=RUN, side=SEAT.side, agent=SEAT.agent, episode=0, step=step, game_loop=step, answer_within_s=20,
        text=f"step {step}", view=View(time_s=0), images=refs,
    )  # fmt: skip
    return Question(shown, STEPS[step])


async def play(connect: Connect, path: Path) -> Looking:
    """Record three steps with an agent that looks."""
    host = await connect()
    policy, stop = Looking(), asyncio.Event()
    with Recorder(path) as recorder:
        bus = RecordingBus(host, recorder, [SEAT])
        card = Run(
            run=RUN, task="t", map_name="m", map_sha256="0", seed=1, episodes=1, game="none", executor="raw",
            clock=Clock(), agents=(AgentCard(name=SEAT.agent, side=SEAT.side, teams=()),), catalogue_sha256="0",
            versions={},
        )  # fmt: skip
        briefing = Briefing(run=RUN, agent=SEAT.agent, side=SEAT.side, episode=0, role="")
        for message, key in (
            (card, run_key(RUN, Topic.RUN)),
            (briefing, agent_key(RUN, *SEAT, Topic.BRIEFING)),
        ):
            await (await bus.publisher(key, Delivery.STATE)).put(encode(message))
        async with Roster(bus, RUN, [SEAT]) as roster, Turn(bus, RUN, roster) as turn:
            worker = asyncio.create_task(run_worker(await connect(), RUN, *SEAT, policy, stop=stop))
            await roster.assemble([SEAT], 10)
            for step in range(len(STEPS)):
                answers = await turn.ask([question(step)])
                assert answers.by_seat[SEAT].status == "ok"
            stop.set()
            await worker  # Zenoh undeclares a publisher for 10 s, with the GIL, while its reader is in this process
    return policy


async def test_what_the_host_shows_the_agent_sees(connect: Connect, tmp_path: Path) -> None:
    policy = await play(connect, tmp_path / "r.mcap")
    assert [sorted(seen.values()) for seen in policy.seen] == [sorted(step) for step in STEPS]


@pytest.fixture
async def recording(tmp_path: Path) -> Path:
    broker = MemoryBroker()

    async def session() -> Bus:
        return broker.session()

    await play(session, tmp_path / "r.mcap")
    return tmp_path / "r.mcap"


async def test_a_recording_holds_each_picture_under_its_hash(recording: Path) -> None:
    found = Recording.open(recording)
    assert found.complete
    assert dict(found.images()) == {hashlib.sha256(data).hexdigest(): data for data in (b"one", BIG, b"three")}
    assert found.counts[f"khala/{RUN}/blue/Stalkers/image/0"] == 2
    assert all(sample.message is None for sample in found if "/image/" in sample.key)
    assert [(step.step, len(step.of(Observation))) for step in found.by_step()] == [(0, 1), (1, 1), (2, 1)]


async def test_a_replayed_agent_is_shown_the_recorded_pictures(recording: Path) -> None:
    policy = Looking()
    assert await replay_agent(Recording.open(recording), SEAT.agent, policy) == []
    assert [sorted(seen.values()) for seen in policy.seen] == [sorted(step) for step in STEPS]


async def test_a_recording_is_told_with_its_pictures(recording: Path) -> None:
    told = [str(part) for part in transcript(recording, StepSelection(), whole=True)]
    assert [line for line in told if "picture" in line] == [
        "  picture screen-0 (512 x 512 PNG, 0 kB): Screen 0.",
        "  picture screen-1 (512 x 512 PNG, 102 kB): Screen 1.",
        "  picture screen-0 (512 x 512 PNG, 0 kB): Screen 0.",
        "  picture screen-1 (512 x 512 PNG, 102 kB): Screen 1.",
    ]
    assert summary(recording, StepSelection())["samples"][f"khala/{RUN}/blue/Stalkers/image/1"] == 2


@pytest.mark.parametrize(
    ("steps", "names"),
    [
        (None, ["0-0000", "0-0001"]),
        ("1", ["0-0001"]),
        ("2-", []),
    ],
)
async def test_pictures_are_written_out_of_a_recording(
    recording: Path, tmp_path: Path, steps: Any, names: list[str]
) -> None:
    saved = save_pictures(recording, StepSelection.of(None, steps), tmp_path / "out")
    assert [path.name for path in saved] == [f"{step}-Stalkers-screen-{k}.png" for step in names for k in (0, 1)]
    assert all(path.read_bytes() in (b"one", b"three", BIG) for path in saved)


async def test_a_directory_that_cannot_be_made_is_named(recording: Path) -> None:
    with pytest.raises(RecordingError, match=r"r\.mcap/x cannot be written: Not a directory"):
        save_pictures(recording, StepSelection(), recording / "x")
