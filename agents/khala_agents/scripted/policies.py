"""Policies that ask no model. `khala_agents.policy.FunctionPolicy` is the third of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_agents.policy import Policy

if TYPE_CHECKING:
    from khala_agents.policy import Context


class Fixed(Policy):
    """A policy that gives the same reply to every observation."""

    def __init__(self, text: str) -> None:
        self._text = text

    async def decide(self, context: Context) -> str:
        """Return the text."""
        del context
        return self._text


class Silent(Fixed):
    """A policy that answers, and orders nothing."""

    def __init__(self) -> None:
        super().__init__("Analysis: I watch.\nActions:\n")
