"""A session's tools for `/mcp`: OpenEnv's server asks this object as it would a client of FastMCP.

OpenEnv brings such a client for environments whose tools are those of a FastMCP server. Here a call is a step of the
session, so it counts, is rewarded and waits for its turn like a step over `/ws`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Self

from openenv.core.env_server.mcp_types import CallToolAction

from khala_sc2.openenv.models import KhalaObservation
from khala_sc2.openenv.tools import tools

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Mapping

    from openenv.core.env_server.types import Observation


class DirectTools:
    """The tools of one session."""

    def __init__(self, step: Callable[[CallToolAction], Awaitable[Observation]]) -> None:
        """Take what calls a tool in the session."""
        self._step = step

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        """Do nothing: the session ends with its connection."""

    def is_connected(self) -> bool:
        """Return True: there is nothing to connect to."""
        return True

    async def list_tools(self) -> list[dict[str, Any]]:
        """Return the tools, in the words of MCP."""
        return [
            {"name": tool.name, "description": tool.description, "inputSchema": tool.input_schema} for tool in tools()
        ]

    async def call_tool(self, name: str, arguments: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Return the result of a call, in the words of MCP; `data` is the text, where OpenEnv's client looks for it.

        Raises:
            KhalaError: no episode goes on, or the match failed.
        """
        action = CallToolAction(tool_name=name, arguments=dict(arguments or {}))
        seen = await self._step(action)
        assert isinstance(seen, KhalaObservation)
        text = seen.result if seen.error is None else seen.error.message
        return {
            "content": [{"type": "text", "text": text}],
            "structuredContent": {"result": text, "reward": seen.reward, "done": seen.done},
            "isError": seen.error is not None,
            "data": text,
        }
