"""The names of the forms of an answer, and what a request carries of one."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from pydantic import model_validator
from pydantic_core import to_json

from khala_protocol.messages import Frozen

if TYPE_CHECKING:
    from collections.abc import Mapping

AnswerForm: TypeAlias = Literal["text", "json", "tools", "grammar"]


class AnswerRule(Frozen):
    """How a model must answer. Also in one word: `json`."""

    form: AnswerForm = "text"
    exact: bool = True
    """Whether the form names only what is possible in the step: its tags, its actions. Otherwise it is the same in all
    steps, which endpoints that cache prompts or compile schemas do better with, and the host refuses what is not
    possible."""

    @model_validator(mode="before")
    @classmethod
    def _in_short(cls, value: Any) -> Any:
        return {"form": value} if isinstance(value, str) else value


@dataclass(frozen=True, slots=True)
class Tool:
    """A tool that a model can call.

    Attributes:
        name: of the action, or of another call of the text language.
        description: for the model.
        parameters: JSON schema of its arguments, an object.
    """

    name: str
    description: str
    parameters: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class AnswerShape:
    """The form that an endpoint must hold an answer to; one of the three.

    Attributes:
        schema: JSON schema of the whole answer.
        tools: the tools that can be called.
        grammar: of the whole answer, in GBNF.
    """

    schema: Mapping[str, Any] = field(default_factory=dict)
    tools: tuple[Tool, ...] = ()
    grammar: str = ""

    @property
    def estimated_tokens(self) -> int:
        """What it adds to a prompt, at about four bytes a token: endpoints put schemas and tools in front of it."""
        tools = [(tool.name, tool.description, tool.parameters) for tool in self.tools]
        return len(to_json([self.schema, tools])) // 4 if self.schema or self.tools else 0
