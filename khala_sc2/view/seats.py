"""The pages of seats that persons take: each behind a token of its own, which opens no other seat.

A page shows what an agent gets and no more: briefing, observations and pictures. It knows neither the map without fog
nor what others think, so its server has no recording. What the person says comes back as the text of a reply.
Above: `khala run --person` and `khala person`. Below: `khala_sc2.playing.persons`, and the rules of `khala view`.
"""

from __future__ import annotations

import asyncio
import contextlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from aiohttp import WSMsgType, web
from pydantic import TypeAdapter, ValidationError

from khala_agents.prompt import Prompt
from khala_protocol.commandline import say
from khala_protocol.errors import ConfigError, KhalaError
from khala_sc2.doors.pages import guard
from khala_sc2.doors.rules import TOKEN
from khala_sc2.view.guard import policy_of, view_door, welcoming
from khala_sc2.view.serve import is_near, name_of, serving, tls_context
from khala_sc2.view.server import page
from khala_sc2.view.wire import (
    MOST_REPLY_CHARACTERS,
    PageNote,
    SeatBriefing,
    SeatQuestion,
    SeatReply,
    SeatResult,
    SeatState,
    SeatTake,
)

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Sequence
    from pathlib import Path

    from khala_protocol.messages import Briefing, Result
    from khala_sc2.doors.rules import Door
    from khala_sc2.playing.persons import PersonQuestion, PersonSeat

MOST_MESSAGE_BYTES: Final = 8 * MOST_REPLY_CHARACTERS
"""Of what a page may send: a character has up to four bytes, and some take two characters in JSON."""
MOST_WINDOW_CHARACTERS: Final = 64
"""Of the name of a window."""
HEARTBEAT_S: Final = 10.0
"""Between two questions to a window whether it is still there."""

_said: TypeAdapter[SeatReply | SeatTake] = TypeAdapter(SeatReply | SeatTake)


@dataclass(frozen=True, slots=True)
class SeatPlace:
    """Where the pages of seats are served.

    Attributes:
        command: that serves them, for what refusals say.
        host: address of this machine.
        port: 0 for a free one.
        https: certificate and key; None for HTTP.
        insecure: whether other machines may reach them without HTTPS.
    """

    command: str
    host: str = "127.0.0.1"
    port: int = 0
    https: tuple[Path, Path] | None = None
    insecure: bool = False

    def door(self) -> Door:
        """Return the rules for who may ask, with a new token.

        Raises:
            ConfigError: other machines could reach it, and read the token on its way.
        """
        near = is_near(self.host)
        if not near and self.https is None and not self.insecure:
            raise ConfigError(
                f"{self.host} can be reached by other machines, and a link without HTTPS can be read on its way: give "
                "--page-https CERT KEY, or --insecure in a network of your own",
                source="--page-host",
            )
        return view_door(is_near=near, is_secure=self.https is not None, command=self.command)


@contextlib.asynccontextmanager
async def serve_seats(seats: Sequence[PersonSeat], place: SeatPlace) -> AsyncIterator[list[str]]:
    """Serve a page for each seat, print its link, and yield the links; persons are told when this ends.

    Raises:
        ConfigError: they cannot be served there.
    """
    context = tls_context(place.https, option="--page-https")
    doors = [place.door() for _ in seats]
    application = web.Application()
    for seat, door in zip(seats, doors, strict=True):
        application.add_subapp(path_of(seat), SeatServer(seat, door).application())
    runner = web.AppRunner(application, access_log=None, shutdown_timeout=1.0)
    await runner.setup()
    try:
        async with serving(runner, place.host, place.port, context, option="--page-port") as port:
            scheme = "http" if context is None else "https"
            origin = f"{scheme}://{name_of(place.host)}:{port}"
            links = [f"{origin}{path_of(seat)}/?{TOKEN}={door.token}" for seat, door in zip(seats, doors, strict=True)]
            for seat, link in zip(seats, links, strict=True):
                say(f"{seat.seat.agent} of {seat.seat.side} is for a person: {link}", err=True)
            try:
                yield links
            finally:
                for seat in seats:
                    seat.end()
    finally:
        await runner.cleanup()


def path_of(seat: PersonSeat) -> str:
    """Return the path of the page of a seat."""
    return f"/seat/{seat.seat.side}/{seat.seat.agent}"


class SeatServer:
    """The web application of one seat.

    Args:
        seat: of the person.
        door: who may ask.
    """

    def __init__(self, seat: PersonSeat, door: Door) -> None:
        self._seat, self._door = seat, door
        self._page = page()

    def application(self) -> web.Application:
        """Return the application."""
        middlewares = [guard(self._door), welcoming(self._door, redirects=False)]
        application = web.Application(middlewares=middlewares, client_max_size=self._door.most_body_bytes)
        application.add_routes([
            web.get("/", self._index),
            web.get("/api/live", self._live),
            web.get(r"/api/images/{sha256:[0-9a-f]{64}}", self._image),
        ])  # fmt: skip
        return application

    async def _index(self, _: web.Request) -> web.Response:
        headers = {"Content-Security-Policy": policy_of(self._page)}
        return web.Response(text=self._page, content_type="text/html", headers=headers)

    async def _image(self, request: web.Request) -> web.Response:
        question = self._seat.question
        for ref, data in question.seen.arrived_pictures() if question else ():
            if ref.sha256 == request.match_info["sha256"]:
                headers = {"Cache-Control": "private, max-age=86400, immutable"}
                return web.Response(body=data, content_type=ref.media_type, headers=headers)
        raise web.HTTPNotFound(text="the newest observation has no such picture\n")

    async def _live(self, request: web.Request) -> web.WebSocketResponse:
        window = request.query.get("window", "")[:MOST_WINDOW_CHARACTERS]
        socket = web.WebSocketResponse(max_msg_size=MOST_MESSAGE_BYTES, heartbeat=HEARTBEAT_S)
        await socket.prepare(request)
        with self._seat.window(window):
            telling = asyncio.create_task(self._tell(socket, window), name=f"tell {self._seat.seat}")
            try:
                async for message in socket:
                    if message.type is WSMsgType.TEXT:
                        await socket.send_str(self._hear(window, message.data).model_dump_json())
            finally:
                telling.cancel()
                await asyncio.wait([telling])
        return socket

    async def _tell(self, socket: web.WebSocketResponse, window: str) -> None:
        """Send what is new whenever the seat changes, and end with the match."""
        seat = self._seat
        briefing: Briefing | None = None
        question: PersonQuestion | None = None
        with contextlib.suppress(ConnectionError):
            while True:
                news = seat.news
                if seat.briefing is not None and seat.briefing is not briefing:
                    briefing = seat.briefing
                    await socket.send_str(_briefing(briefing).model_dump_json())
                if seat.question is not None and seat.question is not question:
                    question = seat.question
                    await socket.send_str(_question(question).model_dump_json())
                await socket.send_str(_state(seat, window).model_dump_json())
                if seat.over:
                    await socket.close()
                    return
                await news.wait()

    def _hear(self, window: str, text: str) -> PageNote:
        """Take what the person says; return what became of it."""
        try:
            said = _said.validate_json(text)
        except ValidationError:
            return PageNote(ok=False, text=f"this is no answer: it has at most {MOST_REPLY_CHARACTERS} characters")
        if isinstance(said, SeatTake):
            self._seat.take(window)
            return PageNote(ok=True, text="You play this seat here now.")
        try:
            self._seat.answer(window, (said.episode, said.step), said.text)
        except KhalaError as error:
            return PageNote(ok=False, text=str(error))
        return PageNote(ok=True, text=f"Sent for step {said.step}.")


def _briefing(briefing: Briefing) -> SeatBriefing:
    prompt = Prompt(briefing)
    texts = (message.content for message in prompt.messages("")[: prompt.stable])
    return SeatBriefing(
        agent=briefing.agent,
        side=briefing.side,
        episode=briefing.episode,
        episodes=briefing.episodes,
        text="\n\n".join(texts),
        actions=tuple(action.name for action in briefing.actions),
        correspondents=tuple(contact.name for contact in briefing.correspondents),
        channels=briefing.channels,
    )


def _question(question: PersonQuestion) -> SeatQuestion:
    observation = question.seen.observation
    return SeatQuestion(
        episode=observation.episode,
        step=observation.step,
        time_s=question.time_s,
        text=observation.text,
        view=observation.view,
        images=tuple(ref for ref, _ in question.seen.arrived_pictures()),
        accepted=observation.accepted,
        rejections=observation.rejections,
        messages=observation.messages,
    )


def _state(seat: PersonSeat, window: str) -> SeatState:
    question = seat.question
    waits = question is not None and question.waits and not seat.over
    return SeatState(
        mine=seat.is_owner(window),
        waits=waits,
        left_s=question.left_s if question is not None and waits else None,
        sent=question.sent if question is not None else None,
        results=tuple(map(_result, seat.results)),
        over=seat.over,
    )


def _result(result: Result) -> SeatResult:
    return SeatResult(
        episode=result.episode,
        ending=result.ending,
        valid=result.valid,
        invalid_because=result.invalid_because,
        killed=result.killed.value,
        lost=result.lost.value,
    )
