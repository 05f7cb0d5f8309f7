"""The tools with which a model plays: their names, their typed arguments, and what they say for its agents.

OpenEnv's `list_tools` and `call_tool` give them to any client, over `/ws`, `/mcp` and HTTP; `khala_sc2.openenv.trl` has
them as methods. The description of a field and the docstring of a class are what a model reads. No I/O.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar, Final

from openenv.core.env_server.mcp_types import Tool, ToolErrorType
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from khala_bridge.knowledge.lookup import find, long
from khala_protocol.errors import KhalaError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

MOST_CHARACTERS: Final = 32_768
"""Of what an agent answers; it is kept in a recording."""


class ToolFault(KhalaError):
    """A call of a tool that a model got wrong: an answer to it, and no fault of the session.

    Attributes:
        kind: which of OpenEnv's errors it is.
    """

    def __init__(self, text: str, kind: ToolErrorType = ToolErrorType.INVALID_ARGS) -> None:
        super().__init__(text)
        self.kind = kind


class PlayTool(BaseModel):
    """A call of a tool, with its arguments as fields."""

    model_config = ConfigDict(extra="forbid")
    name: ClassVar[str]


class Observe(PlayTool):
    """Read what you see now, below your briefing at the first time. It begins an episode if none goes on."""

    name = "observe"


class Act(PlayTool):
    """Give orders to your teams, write to other agents, and play until you are asked again.

    It returns what you see then, with the orders that were refused and why.
    """

    name = "act"

    orders: dict[str, list[str]] = Field(
        default_factory=dict,
        description="By team, its actions one after the other, in the form that the observation lists: "
        '{"Zealot-1": ["<Attack_Unit(0x100200000)>"]}. A team that is not named goes on as before.',
    )
    messages: dict[str, str] = Field(
        default_factory=dict, description="By agent or channel that the observation names, what it is to read."
    )
    agent: str = Field(default="", description="Who acts; needed only where you play several agents.")


class ReplyInText(PlayTool):
    """Answer in the text language that your briefing teaches, and play until you are asked again."""

    name = "reply"

    text: str | None = Field(
        default=None, max_length=MOST_CHARACTERS, description="Of the agent, where you play one agent."
    )
    replies: dict[str, str] = Field(
        default_factory=dict,
        description="By agent, where you play several. An agent that is asked and not named does nothing.",
    )


class LookUp(PlayTool):
    """Read all that is known of a unit type, an upgrade or an ability: numbers, costs, what it is good against."""

    name = "look_up"

    what: str = Field(description="Its name: Stalker, Blink, Effect_Blink.", max_length=200)

    def answer(self) -> str:
        """Return what is known.

        Raises:
            ToolFault: nothing has this name.
        """
        try:
            return "\n".join(long(entry) for entry in find(self.what))
        except KhalaError as error:
            raise ToolFault(str(error)) from error


TOOLS: Final[Mapping[str, type[PlayTool]]] = {tool.name: tool for tool in (Observe, Act, ReplyInText, LookUp)}


def tools() -> list[Tool]:
    """Return the tools as OpenEnv lists them."""
    return [
        Tool(name=tool.name, description=" ".join((tool.__doc__ or "").split()), input_schema=_schema(tool))
        for tool in TOOLS.values()
    ]


def _schema(tool: type[PlayTool]) -> dict[str, Any]:
    schema = tool.model_json_schema()
    return {name: value for name, value in schema.items() if name not in ("title", "description")}


def read_call(name: str, arguments: Mapping[str, Any]) -> PlayTool:
    """Return a call of a tool.

    Raises:
        ToolFault: there is no such tool, or it takes other arguments.
    """
    tool = TOOLS.get(name)
    if tool is None:
        raise ToolFault(f"there is no tool {name!r}: there are {', '.join(TOOLS)}", ToolErrorType.TOOL_NOT_FOUND)
    try:
        return tool.model_validate(arguments)
    except ValidationError as error:
        wrong = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(map(str, wrong["loc"])) or "arguments"
        known = ", ".join(tool.model_fields) or "none"
        raise ToolFault(f"{name}: {where}: {wrong['msg']}; its arguments are {known}") from None


def reply_of(act: Act) -> str:
    """Return orders and messages in the text language."""
    lines = ["Actions:"]
    for team, actions in act.orders.items():
        lines += [f"Team {_in_line(team)}:", *map(_in_line, actions)]
    if act.messages:
        lines += ["Communications:"]
        lines += [f"<MessageTo({_in_line(to)}, '''{_quotable(text)}''')>" for to, text in act.messages.items()]
    return "\n".join(lines)


def names(agents: Sequence[str]) -> str:
    """Return the names of agents for a sentence."""
    return ", ".join(agents) or "nobody"


def _in_line(text: str) -> str:
    return " ".join(text.split())


def _quotable(text: str) -> str:
    return text.replace("'''", '"')
