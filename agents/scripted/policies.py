"""Policies that ask no model. `agents.policy.FunctionPolicy` is the third of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from protocol.messages import Briefing, Observation


class Fixed:
    """Gives the same reply to every observation."""

    def __init__(self, text: str) -> None:
        self._text = text

    async def decide(self, briefing: Briefing, observation: Observation) -> str:
        """The text."""
        del briefing, observation
        return self._text


class Silent(Fixed):
    """Answers, and orders nothing."""

    def __init__(self) -> None:
        super().__init__("Analysis: I watch.\nActions:\n")
