"""Policies that ask no model: scripted players within a worker, and fixed replies.

`khala_agents.scripted.players` has the players. `khala_agents.policy.FunctionPolicy` is the third such policy.
"""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

from khala_agents.policy import Policy
from khala_agents.scripted.players import PLAYERS

if TYPE_CHECKING:
    from khala_agents.policy import Context
    from khala_agents.scripted.players import PlayerName


class Fixed(Policy):
    """A policy that gives the same reply to every observation."""

    def __init__(self, text: str) -> None:
        self._text = text

    async def decide(self, context: Context) -> str:
        """Return the text."""
        del context
        return self._text


class ScriptedPlayer(Policy):
    """A scripted player within a worker: it plays from the text of the observation alone.

    Args:
        name: of the player.
        seed: for what it leaves to chance; the same seed and text give the same reply.
    """

    def __init__(self, name: PlayerName, *, seed: int = 0) -> None:
        self._play = PLAYERS[name]
        self._seed = seed

    async def decide(self, context: Context) -> str:
        """Return the player's reply."""
        text = context.observation.text
        return self._play(text, random.Random(f"{self._seed} {text}"))


class Silent(Fixed):
    """A policy that answers, and orders nothing."""

    def __init__(self) -> None:
        super().__init__("Analysis: I watch.\nActions:\n")
