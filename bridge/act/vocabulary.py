"""The names that one agent may say: its actions by any spelling of them, and those that a wrong name is near to.

Made once for an agent of a task. Case, underscores, blanks and hyphens make no difference to a name, since no two
actions differ in nothing else; aliases of the catalogue count as names. Above it is `bridge.act.recognise`.
"""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bridge.action import Action
    from bridge.observe.sight import TeamSight
    from bridge.task import AgentConfig

CLOSE = 0.8
"""Similarity of two names, 0 to 1, above which one is taken for a slip of the other."""
NEAREST = 3
"""Actions that a refusal names when none is that close."""


class Vocabulary:
    """What an agent may say."""

    def __init__(self, agent: AgentConfig) -> None:
        """Takes the names of all actions of its teams."""
        self._agent = agent
        self._actions: dict[str, Action] = {}
        for action in agent.catalogue():
            self._actions[squashed(action.name)] = action
        for action in agent.catalogue():
            for alias in action.aliases:
                self._actions.setdefault(squashed(alias), action)

    def find(self, name: str) -> Action | None:
        """The action of this name, in any spelling; None if the agent has no such action."""
        return self._actions.get(squashed(name))

    def has(self, team: TeamSight, action: Action) -> bool:
        """Whether a team may ever be told to do an action, with the units that it has now."""
        return action.name in team.team.config.actions or any(
            action.name in self._agent.actions.get(unit_type, ()) for unit_type in _types(team)
        )

    def near(self, name: str, teams: Iterable[TeamSight]) -> tuple[bool, list[Action]]:
        """Actions of some teams, or of all, whose names are most like a wrong one, the likest first.

        Returns:
            Whether the first one is most likely what was meant, and the actions, at most `NEAREST`.
        """
        teams = list(teams)
        known = [a for a in self._agent.catalogue() if not teams or any(self.has(team, a) for team in teams)]
        wanted = squashed(name)
        ranked = sorted(known, key=lambda action: -_likeness(wanted, name, action))[:NEAREST]
        meant = bool(ranked) and _ratio(wanted, squashed(ranked[0].name)) >= CLOSE
        return meant, ranked


def squashed(name: str) -> str:
    """A name without what models vary in it: case, underscores, blanks, hyphens."""
    return "".join(filter(str.isalnum, name)).casefold()


def _likeness(wanted: str, name: str, action: Action) -> float:
    """How like a name an action's is: by its letters, and by the words that both have."""
    words, its_words = _words(name), _words(action.name)
    shared = len(words & its_words) / max(len(words), 1)
    return _ratio(wanted, squashed(action.name)) + shared


def _words(name: str) -> set[str]:
    return {word.casefold() for word in name.replace("-", "_").split("_")}


def _ratio(one: str, other: str) -> float:
    return difflib.SequenceMatcher(None, one, other).ratio()


def _types(team: TeamSight) -> list[str]:
    return list(dict.fromkeys(unit.type for unit in team.view.units))
