"""The pages of persons' seats: who may open them, and what goes over their websocket."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
from typing import TYPE_CHECKING, Any

import aiohttp
import pytest

from khala_agents.pictures import PictureStore
from khala_agents.policy import Context
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_orchestrator.past.replay import recorded_config
from khala_protocol.errors import ConfigError
from khala_protocol.messages import Briefing, ImageRef, Observation, Reply, Report, Result, Run, View
from khala_protocol.recording import Recording
from khala_sc2.playing import one_process
from khala_sc2.playing.minds import Minds
from khala_sc2.playing.persons import PersonSeat, with_persons
from khala_sc2.playing.seats import Seat
from khala_sc2.view.seats import SeatPlace, serve_seats
from tests.khala.view.made import opened

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

HERE = SeatPlace("khala run")
STALKERS, ZEALOTS = Seat("blue", "Stalkers"), Seat("blue", "Zealots")
PICTURE = b"a picture"
REF = ImageRef(
    name="screen", media_type="image/png", sha256=hashlib.sha256(PICTURE).hexdigest(), width=2, height=2, bytes=9
)


class Window:
    """A browser's window with a seat."""

    def __init__(self, session: aiohttp.ClientSession, link: str) -> None:
        self._session = session
        self.link = link
        self.page = link.partition("?")[0]
        self.origin = link.partition("/seat/")[0]
        self._socket: aiohttp.ClientWebSocketResponse

    async def enter(self) -> None:
        async with self._session.get(self.link, allow_redirects=False) as page:
            assert (page.status, "<html" in await page.text()) == (200, True)

    @contextlib.asynccontextmanager
    async def sits(self, name: str) -> AsyncIterator[Window]:
        address = f"{self.page}api/live?window={name}"
        async with self._session.ws_connect(address, origin=self.origin) as socket:
            window = Window(self._session, self.link)
            window._socket = socket
            yield window

    async def hear(self, kind: str, **wanted: Any) -> dict[str, Any]:
        """Wait for a message of a kind with these fields."""
        while True:
            told: dict[str, Any] = await self._socket.receive_json(timeout=20)
            if told["kind"] == kind and all(told[name] == value for name, value in wanted.items()):
                return told

    async def say(self, **words: Any) -> dict[str, Any]:
        """Say something, and return what became of it."""
        await self._socket.send_json(words)
        return await self.hear("note")


@contextlib.asynccontextmanager
async def windows(*seats: PersonSeat, place: SeatPlace = HERE) -> AsyncIterator[list[Window]]:
    """Serve seats, and yield a browser of its own for each."""
    async with contextlib.AsyncExitStack() as stack:
        links = await stack.enter_async_context(serve_seats(seats, place))
        found = []
        for link in links:
            jar = aiohttp.CookieJar(unsafe=True)
            session = await stack.enter_async_context(aiohttp.ClientSession(cookie_jar=jar))
            found.append(Window(session, link))
        yield found


@contextlib.asynccontextmanager
async def asked(seat: PersonSeat) -> AsyncIterator[asyncio.Task[Any]]:
    """Ask a seat step 3, as its worker does."""
    observation = Observation(
        run="test", agent="Stalkers", side="blue", episode=0, step=3, game_loop=24, answer_within_s=None,
        text="what you see", view=View(time_s=1.0), images=(REF,),
    )  # fmt: skip
    pictures = PictureStore()
    await pictures.put(PICTURE)
    briefing = Briefing(run="test", agent="Stalkers", side="blue", episode=0, role="You command the Stalkers.")
    deciding = asyncio.create_task(seat.decide(Context(briefing, observation, pictures)))
    try:
        yield deciding
    finally:
        deciding.cancel()
        await asyncio.wait({deciding})


async def test_a_link_opens_its_own_seat_and_no_other() -> None:
    async with windows(PersonSeat(STALKERS), PersonSeat(ZEALOTS)) as (stalkers, zealots):
        assert stalkers.page.endswith("/seat/blue/Stalkers/")
        await stalkers.enter()
        async with stalkers.sits("a") as window:
            assert (await window.hear("state"))["mine"]
        for address in (zealots.page, f"{zealots.page}?{stalkers.link.partition('?')[2]}"):
            async with stalkers._session.get(address) as refused:
                assert refused.status == 401
                assert "open the address that `khala run` printed" in await refused.text()
        with pytest.raises(aiohttp.WSServerHandshakeError, match="401"):
            async with zealots.sits("a"):
                pass
        with pytest.raises(aiohttp.WSServerHandshakeError, match="403"):
            async with stalkers._session.ws_connect(f"{stalkers.page}api/live", origin="http://evil.example"):
                pass


async def test_a_window_gets_briefing_observation_and_pictures_and_its_answer_is_the_decision() -> None:
    seat = PersonSeat(STALKERS)
    async with windows(seat) as (browser,), asked(seat) as deciding:
        await browser.enter()
        async with browser.sits("a") as window:
            assert "You command the Stalkers." in (await window.hear("briefing"))["text"]
            question = await window.hear("question")
            assert (question["step"], question["text"], question["time_s"]) == (3, "what you see", None)
            async with browser._session.get(f"{browser.page}api/images/{question['images'][0]['sha256']}") as picture:
                assert (await picture.read(), picture.content_type) == (PICTURE, "image/png")
            answer = {"kind": "reply", "episode": 0, "step": 3, "text": "<Stop()>"}
            assert await window.say(**answer) == {"kind": "note", "ok": True, "text": "Sent for step 3."}
            assert await deciding == "<Stop()>"
            assert "answered already" in (await window.say(**answer))["text"]
            assert (await window.say(kind="reply", step="x"))["ok"] is False
            assert (await window.say(kind="reply", episode=0, step=3, text="x" * 40_000))["ok"] is False


async def test_a_second_window_looks_on_until_it_takes_the_seat() -> None:
    seat = PersonSeat(STALKERS)
    async with windows(seat) as (browser,), asked(seat) as deciding:
        await browser.enter()
        async with browser.sits("a") as first, browser.sits("b") as second:
            assert not (await second.hear("state"))["mine"]
            answer = {"kind": "reply", "episode": 0, "step": 3, "text": "b"}
            assert "another window" in (await second.say(**answer))["text"]
            assert (await second.say(kind="take"))["ok"]
            await first.hear("state", mine=False)
            assert (await second.say(**answer))["ok"]
            assert await deciding == "b"


def test_other_machines_reach_a_seat_over_https_or_if_that_is_wanted() -> None:
    with pytest.raises(ConfigError, match="--page-https CERT KEY, or --insecure") as refused:
        SeatPlace("khala run", host="0.0.0.0").door()
    assert refused.value.source == "--page-host"
    assert not SeatPlace("khala run", host="192.168.0.7", insecure=True).door().is_near


@pytest.mark.game
async def test_a_decision_that_a_person_did_not_make_in_time_is_not_counted_as_a_human_s() -> None:
    seat = PersonSeat(STALKERS)
    config = MatchConfig(task=change(load_task("2s3z_pair"), max_steps=2, max_wait_s=0.3), run="people")
    minds = {"blue": Minds().with_name("skilled")}
    (result,) = await one_process.play(config, minds, game="simulator", callers={STALKERS: seat})
    assert (result.statuses["Stalkers"], result.humans) == ({"late": 2}, {"Stalkers": 0})


@pytest.mark.game
async def test_a_person_plays_a_match_beside_an_agent_and_everything_says_that_it_was_a_human(tmp_path: Path) -> None:
    seat = PersonSeat(STALKERS)
    record = tmp_path / "recording.mcap"
    config = MatchConfig(task=change(load_task("2s3z_pair"), max_steps=3), run="people", record=record)
    config = with_persons(config, {STALKERS})
    minds = {"blue": Minds().with_name("skilled")}
    async with windows(seat) as (browser,):
        await browser.enter()
        playing = asyncio.create_task(one_process.play(config, minds, game="simulator", callers={STALKERS: seat}))
        async with browser.sits("a") as window:
            for step in range(3):
                question = await window.hear("question", step=step)
                assert question["accepted"] == [f"Stalker-1 <Move_Screen([{13 + step}, 12])>"][: bool(step)]
                team = question["view"]["teams"][0]
                text = f"Actions:\n    Team {team['name']}:\n        <Move_Screen([{14 + step}, 12])>\n"
                assert (await window.say(kind="reply", episode=0, step=step, text=text))["ok"]
        (result,) = await playing
    recording = Recording.open(record)
    assert (result.valid, result.humans, result.statuses["Stalkers"]) == (True, {"Stalkers": 3}, {"ok": 3})
    (card,) = recording.of(Run)
    assert {agent.name: agent.human for agent in card.agents} == {"Stalkers": True, "Zealots": False}
    assert {(reply.agent, reply.human) for reply in recording.of(Reply)} == {("Stalkers", True), ("Zealots", False)}
    reported = {(one.agent, one.human) for report in recording.of(Report) for one in report.agents}
    assert reported == {("Stalkers", True), ("Zealots", False)}
    assert list(recording.of(Result)) == [result]
    assert recorded_config(recording).humans == config.humans
    view = opened(record)
    assert {line.name: line.model for line in view.agents()}["Stalkers"] == "human"
    view.index.close()
