"""A bot of somebody else's that plays the second player, as on a ladder: its port, its process, and how it ends.

Ladders hand a bot a websocket of the game with `--LadderServer`, `--GamePort` and `--StartPort`, and python-sc2, ares,
sharpy and the C++ API all take it from there. Here the websocket is Khala's: it passes requests on to the game process
of the guest, one at a time, and so knows what the guest is called, when it left, and whether the guest or the game
hangs. `khala_bridge.game.manners` says what a guest may ask for. Above: `khala_bridge.game.meeting`.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import shlex
import subprocess
import threading
import time
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NotYet
from typing import TYPE_CHECKING, Any

from aiohttp import WSMsgType, web
from s2clientprotocol import sc2api_pb2 as sc_pb

from khala_bridge.errors import GameError
from khala_bridge.game.manners import Manners
from khala_protocol.files import open_private
from khala_protocol.platforms import apart
from khala_protocol.trust import check_trusted

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from khala_bridge.game.invitation import Invitation
    from khala_bridge.game.manners import LanPorts
    from khala_bridge.state import Forfeit
    from khala_bridge.task.opponent import Opponent

log = logging.getLogger(__name__)

HOST = "127.0.0.1"
_LOOK_S = 0.1
_FAREWELL_S = 5.0
"""Time that a guest gets after the end of the game to read its result and leave, and its process to end."""
_CLOSE_S = 0.5
_QUOTED_LINES = 3


class Guest:
    """One guest in one game. The methods are for the thread of the game; the websocket has a thread of its own."""

    def __init__(self, process: Any, ports: LanPorts, opponent: Opponent, invitation: Invitation) -> None:
        """Take a game process of PySC2 that nobody else talks to, and who plays in it."""
        self.forfeit: Forfeit | None = None
        """How it went away from a game that was going on."""
        self._process = process
        self._ports = ports
        self._opponent = opponent
        self._invitation = invitation
        self._manners = Manners(ports)
        self._socket = process.controller._client._sock  # noqa: SLF001  # requests pass as bytes
        self._socket.settimeout(None)  # its step waits as long as our agents think
        self._client: web.WebSocketResponse | None = None
        self._bot: subprocess.Popen[bytes] | None = None
        self._asked, self._left = threading.Event(), threading.Event()
        self._joined: Future[None] = Future()
        self._listening: Future[tuple[asyncio.AbstractEventLoop, asyncio.Event]] = Future()
        self._thread = threading.Thread(target=self._serve, name="guest", daemon=True)

    @property
    def name(self) -> str:
        """What it is called, and its race, as it said when it joined."""
        return f"guest bot {self._manners.name or 'without a name'}, {self._manners.race}"

    @property
    def arguments(self) -> tuple[str, ...]:
        """The end of the command line that starts a bot, as ladders write it."""
        port, start = str(self._ports.websocket), str(self._ports.start)
        return "--LadderServer", HOST, "--GamePort", port, "--StartPort", start, "--OpponentId", "khala"

    def invite(self, environment: Mapping[str, str] | None) -> None:
        """Open the websocket, start the bot or say how, and wait until it asks to join.

        Raises:
            GameError: it did not come.
        """
        self._thread.start()
        self._listening.result()
        if self._opponent.command:
            check_trusted([shlex.join(self._opponent.command)])
            self._bot = _start(self._opponent.command + self.arguments, environment, self._invitation.log)
        else:
            self._invitation.say(f"start the bot: python run.py {shlex.join(self.arguments)}")
        self._wait(self._asked.is_set)

    def until_joined(self) -> None:
        """Wait until it is in the game, which the host has to join as well.

        Raises:
            GameError: the game did not take it, or it went away.
        """
        self._wait(self._joined.done)
        self._joined.result()

    def close(self, *, farewell: bool) -> None:
        """End its game and its process; with `farewell`, after it had time to read the result."""
        if farewell:
            self._left.wait(_FAREWELL_S)
        if self._process.running:
            self._process._proc.kill()  # noqa: SLF001  # a request that waits in it has no other end
        self._process.close()
        with contextlib.suppress(NotYet):
            loop, stop = self._listening.result(0)
            loop.call_soon_threadsafe(stop.set)
            self._thread.join()
        if self._bot is not None:
            _end(self._bot)

    def _wait(self, done: Any) -> None:
        until_s = time.monotonic() + self._opponent.wait_s
        while not done():
            if self._bot is not None and self._bot.poll() is not None:
                raise GameError(f"the guest ended with code {self._bot.returncode} before it joined{self._quote()}")
            if self._invitation.withdrawn.wait(_LOOK_S):
                raise GameError("the match was given up before the guest joined")
            if time.monotonic() > until_s:
                raise GameError(
                    f"no guest joined within {self._opponent.wait_s:g} s: start the bot with "
                    f"{shlex.join(self.arguments)}, or give it more time with wait_s{self._quote()}"
                )

    def _quote(self) -> str:
        if self._bot is None or self._invitation.log is None:
            return ""
        lines = [line.strip() for line in self._invitation.log.read_text(errors="replace").splitlines()]
        return f": {' / '.join(list(filter(None, lines))[-_QUOTED_LINES:])}" if any(lines) else ""

    # the thread of the websocket

    def _serve(self) -> None:
        try:
            asyncio.run(self._listen())
        except OSError as error:
            self._listening.set_exception(GameError(f"no guest can join: {error}"))

    async def _listen(self) -> None:
        app = web.Application()
        app.router.add_get("/sc2api", self._visit)
        runner = web.AppRunner(app, access_log=None, shutdown_timeout=_CLOSE_S)
        await runner.setup()
        stop = asyncio.Event()
        try:
            await web.TCPSite(runner, HOST, self._ports.websocket).start()
            self._listening.set_result((asyncio.get_running_loop(), stop))
            await stop.wait()
            if self._client is not None:
                await self._client.close()
        finally:
            await runner.cleanup()

    async def _visit(self, request: web.Request) -> web.StreamResponse:
        if self._asked.is_set():
            raise web.HTTPConflict(text="a guest plays here already")
        self._client = client = web.WebSocketResponse(max_msg_size=0, compress=False, timeout=_CLOSE_S)
        await client.prepare(request)
        why: Forfeit = "guest gone"
        try:
            await self._pass_on(client)
        except TimeoutError:
            why = "guest hung"
        except Exception:  # whatever ends its connection or its game, it is gone
            log.debug("the connection of the guest broke", exc_info=True)
        if self._asked.is_set():
            await self._leave(why)
        return client

    async def _pass_on(self, client: web.WebSocketResponse) -> None:
        """Answer requests until the guest goes away. Between two of them only the guest can be slow."""
        while (frame := await client.receive(self._opponent.wait_s)).type is WSMsgType.BINARY:
            asked = self._manners.read(frame.data)
            if asked.kind == "join_game":
                self._asked.set()
            elif asked.kind == "leave_game" and self._manners.playing:
                self.forfeit = "guest left"
            await client.send_bytes(asked.answer or await self._answer(asked.passed))
            if asked.kind == "quit":
                return

    async def _answer(self, data: bytes) -> bytes:
        answer = await asyncio.get_running_loop().run_in_executor(None, self._exchange, data)
        if self._manners.note(answer) and not self._joined.done():
            self._settle_join()
        return answer

    def _settle_join(self) -> None:
        if self._manners.refused:
            self._joined.set_exception(GameError(f"the game refused the guest: {self._manners.refused}"))
        else:
            self._joined.set_result(None)

    def _exchange(self, data: bytes) -> bytes:
        self._socket.send_binary(data)
        answer: bytes = self._socket.recv()
        return answer

    async def _leave(self, why: Forfeit) -> None:
        """Leave the game for a guest that went away, so that the game gives its result to the other player."""
        if not self._joined.done():
            self._joined.set_exception(GameError("the guest went away before the game began"))
        if self._manners.playing:
            self.forfeit = self.forfeit or why
            leave = sc_pb.Request(leave_game=sc_pb.RequestLeaveGame()).SerializeToString()
            with contextlib.suppress(Exception):  # the game may be gone as well
                await asyncio.get_running_loop().run_in_executor(None, self._exchange, leave)
        self._left.set()


def _start(
    command: tuple[str, ...], environment: Mapping[str, str] | None, log: Path | None
) -> subprocess.Popen[bytes]:
    try:
        with contextlib.ExitStack() as stack:
            out = stack.enter_context(open_private(log, "wb")) if log else subprocess.DEVNULL
            return subprocess.Popen(  # noqa: S603  # the user names it
                command, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT, env=environment,
                **apart(),
            )  # fmt: skip
    except OSError as error:
        raise GameError(f"the guest cannot be started with {command[0]}: {error.strerror}") from None


def _end(bot: subprocess.Popen[bytes]) -> None:
    """Wait until the process ends, which it should without its game; else end it."""
    for end in (bot.terminate, bot.kill):
        try:
            bot.wait(_FAREWELL_S)
        except subprocess.TimeoutExpired:
            end()
    bot.wait()
