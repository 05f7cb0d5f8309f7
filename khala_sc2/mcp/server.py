"""One seat as an MCP server: tools to observe, act, write and look up, resources for the briefing and the pictures.

Above: `khala_sc2.mcp.serve`, which connects it. Below: `khala_sc2.mcp.table`, and the official SDK. A seat is a server of its
own, with an address of its own: protocol versions from 2026-07-28 on have no sessions that could hold one.
"""

from __future__ import annotations

import contextlib
from functools import partial
from typing import TYPE_CHECKING, Annotated, Final

from mcp.server.mcpserver import Context, Image, MCPServer
from mcp.server.mcpserver.exceptions import ResourceNotFoundError, ToolError
from mcp.server.mcpserver.resources import FunctionResource
from mcp.types import ToolAnnotations
from pydantic import Field

from khala_bridge.knowledge.lookup import find, long
from khala_protocol.errors import KhalaError
from khala_sc2 import __version__
from khala_sc2.doors.rules import cookies
from khala_sc2.mcp.holder import Holder
from khala_sc2.mcp.words import briefing_page, instructions, page, step_line

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterator, Mapping

    from khala_protocol.messages import Report
    from khala_sc2.mcp.table import Table, TableLook
    from khala_sc2.playing.seats import Seat, Seen

WITHIN_S = 25.0
"""Longest time that a tool waits for the match: clients give up after 60 s, or sooner."""

MOST_REPLY_CHARACTERS: Final = 32_768
"""Of an answer; it is kept in the recording."""
MOST_MESSAGE_CHARACTERS: Final = 2_000
NOTHING = "nothing has been observed yet: call the tool observe first"


SESSION: Final = "mcp-session-id"
CLIENT: Final = "khala_client"
"""The cookie that names a client without a session."""


def server_of(table: Table, seat: Seat, holder: Holder | None = None) -> MCPServer[None]:
    """Return the server of one seat of a table.

    Args:
        table: the match.
        seat: that clients of this server play.
        holder: which of them plays it.
    """
    return _SeatServer(table, seat, holder or Holder(str(seat))).server


class _SeatServer:
    """The tools and resources of one seat."""

    def __init__(self, table: Table, seat: Seat, holder: Holder) -> None:
        self._table, self._seat, self._holder = table, seat, holder
        self.server: MCPServer[None] = MCPServer(
            f"khala {seat}",
            title=f"Khala: {seat.agent} in {table.config.task.name}",
            instructions=instructions(table.config, seat),
            version=__version__,
            warn_on_duplicate_resources=False,
        )
        reads = ToolAnnotations(read_only_hint=True, open_world_hint=False)
        acts = ToolAnnotations(read_only_hint=False, destructive_hint=False, open_world_hint=False)
        for tool, hints in ((self.observe, reads), (self.act, acts), (self.message, acts), (self.look_up, reads)):
            self.server.add_tool(tool, annotations=hints, structured_output=False)
        self._add("briefing", "Who you are, what you may do, and how.", "text/markdown", self._briefing)
        self._add("observation", "What you saw last.", "text/plain", self._observation)

    async def observe(
        self,
        ctx: Context[None],
        *,
        briefing: Annotated[bool, Field(description="Read the briefing again, above the observation.")] = False,
    ) -> list[str | Image]:
        """Wait until you are asked, and read what you see, with the time that you have for an answer.

        The first observation stands below your briefing: who you are, your actions, and the form of an answer.
        """
        with _clear(), self._playing(ctx):
            return self._shown(await self._look(ctx), briefing=briefing)

    async def act(
        self,
        ctx: Context[None],
        reply: Annotated[
            str,
            Field(
                description='Your answer: "Analysis:", then "Actions:", a line "Team NAME:" for each team, and under '
                "it its actions, such as <Attack_Unit(0x1002c0001)>. Empty to go on as before.",
                max_length=MOST_REPLY_CHARACTERS,
            ),
        ],
    ) -> list[str | Image]:
        """Answer the observation that you saw last, and wait for the next one: it says what was refused, and why."""
        with _clear(), self._playing(ctx):
            self._table.act(self._seat, reply)
            return self._shown(await self._look(ctx))

    async def message(
        self,
        ctx: Context[None],
        to: Annotated[str, Field(description="An agent or a channel that the observation names.")],
        text: Annotated[
            str, Field(description="What it is to read.", min_length=1, max_length=MOST_MESSAGE_CHARACTERS)
        ],
    ) -> str:
        """Write to another agent: the message goes out with your next act, and arrives with its next observation."""
        with _clear(), self._playing(ctx):
            self._table.message(self._seat, to, text)
        return f"Your next act takes it to {to}."

    def look_up(
        self,
        name: Annotated[str, Field(description="A unit type, an upgrade or an ability: Stalker, Effect_Blink.")],
    ) -> str:
        """Read all that is known of a unit type, an upgrade or an ability: numbers, costs, what it is good against."""
        with _clear():
            return "\n".join(long(entry) for entry in find(name))

    @contextlib.contextmanager
    def _playing(self, ctx: Context[None]) -> Iterator[None]:
        """Hold the seat for the client of a request while it is answered, and for a while after that.

        Raises:
            Taken: another client plays it.
        """
        client = client_of(ctx.headers or {})
        self._holder.take(client)
        yield
        self._holder.take(client)

    async def _look(self, ctx: Context[None]) -> TableLook:
        async def on_step(report: Report) -> None:
            await ctx.report_progress(report.game_loop, message=step_line(report))

        return await self._table.look(self._seat, within_s=WITHIN_S, on_step=on_step)

    def _shown(self, look: TableLook, *, briefing: bool = False) -> list[str | Image]:
        text = page(look, self._table.config)
        if look.seen is None:
            return [text]
        if self._holder.brief() or briefing:
            text = f"{briefing_page(look.seen.briefing)}\n{text}"
        shown: list[str | Image] = [text]
        for ref, picture in look.seen.arrived_pictures():
            self._add(f"pictures/{ref.name}", ref.title, ref.media_type, partial(self._picture, ref.name))
            shown += [ref.title or ref.name, Image(data=picture, format=ref.media_type.removeprefix("image/"))]
        return shown

    def _add(self, path: str, description: str, mime_type: str, read: Callable[[], Awaitable[str | bytes]]) -> None:
        uri = f"khala://{path}"
        self.server.add_resource(
            FunctionResource(uri=uri, name=path, description=description, mime_type=mime_type, fn=read)
        )

    def _newest(self) -> Seen:
        seen = self._table.newest(self._seat)
        if seen is None:
            raise ResourceNotFoundError(NOTHING)
        return seen

    async def _briefing(self) -> str:
        return briefing_page(self._newest().briefing)

    async def _observation(self) -> str:
        return self._newest().observation.text

    async def _picture(self, name: str) -> bytes:
        for ref, picture in self._newest().arrived_pictures():
            if ref.name == name:
                return picture
        raise ResourceNotFoundError(f"the newest observation has no picture {name}")


def client_of(headers: Mapping[str, str]) -> str:
    """Return what names the client of a request: its session, or its cookie; "" if it has neither."""
    if session := headers.get(SESSION):
        return f"session {session}"
    cookie = next(cookies([headers.get("cookie", "")], CLIENT), "")
    return cookie and f"cookie {cookie}"


@contextlib.contextmanager
def _clear() -> Iterator[None]:
    """Let the client read what is wrong and what to do."""
    try:
        yield
    except KhalaError as error:
        raise ToolError(str(error)) from error
