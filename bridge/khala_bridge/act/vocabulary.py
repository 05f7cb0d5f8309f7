"""The names that one agent may use: its actions in any spelling, and the nearest ones to a wrong name.

Made once for an agent of a task. Case, underscores, blanks and hyphens do not matter, since no two actions differ only
in these; aliases of the catalogue count as names. Above it is `khala_bridge.act.recognise`.
"""

from __future__ import annotations

import difflib
import functools
import itertools
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from khala_bridge.catalogue.action import Action
    from khala_bridge.observe.observation import TeamObservation
    from khala_bridge.task.config import AgentConfig

CLOSE = 0.8
"""Similarity of two names, 0 to 1, above which one counts as a slip of the other."""
ALIKE = 0.7
"""Likeness of two names, 0 to 2, above which a refusal of one mentions the other."""
NEAREST = 3
"""Actions that a refusal names at most."""


class Vocabulary:
    """The names that an agent may use."""

    def __init__(self, agent: AgentConfig) -> None:
        """Take the names of all actions of its teams."""
        self._agent = agent
        self._actions: dict[str, Action] = {}
        self._catalogue = agent.catalogue()
        self._by_name = {action.name: action for action in self._catalogue}
        for action in self._catalogue:
            self._actions[squash(action.name)] = action
        for action in self._catalogue:
            for alias in action.aliases:
                self._actions.setdefault(squash(alias), action)

    def find(self, name: str) -> Action | None:
        """Return the action of this name, in any spelling; None if the agent has no such action."""
        return self._actions.get(squash(name))

    def has(self, team: TeamObservation, action: Action) -> bool:
        """Return True if a team has an action, with its present units."""
        return action.name in team.config.actions or any(
            action.name in self._agent.actions.get(unit.type, ()) for unit in team.view.units
        )

    def hint(self, name: str, teams: Iterable[TeamObservation]) -> str:
        """Return the actions that some teams have instead of a wrong name, as the end of a sentence."""
        wanted = squash(name)
        words = _split(name)
        known = list(self._sayable(list(teams)))
        likeness = {action.name: _likeness(_pairs(wanted), words, action.name) for action in known}
        ranked = sorted(known, key=lambda action: -likeness[action.name])[:NEAREST]
        if ranked and difflib.SequenceMatcher(None, wanted, squash(ranked[0].name)).ratio() >= CLOSE:
            return f"did you mean {ranked[0].form}?"
        alike = [action.form for action in ranked if likeness[action.name] >= ALIKE]
        if alike:
            return f"like it {'is' if len(alike) == 1 else 'are'} {', '.join(alike)}."
        more = len(known) - NEAREST
        others = f" and {more} other{'s' if more > 1 else ''}" if more > 0 else ""
        return f"you can say {', '.join(action.form for action in known[:NEAREST])}{others}."

    def _sayable(self, teams: list[TeamObservation]) -> Iterable[Action]:
        """Return the actions of some teams, in the order of the task's lists; all actions if there are no teams."""
        if not teams:
            return self._catalogue
        types = dict.fromkeys(unit.type for team in teams for unit in team.view.units)
        lists = (*(team.config.actions for team in teams), *(self._agent.actions.get(name, ()) for name in types))
        return [self._by_name[name] for name in dict.fromkeys(name for listed in lists for name in listed)]


@functools.lru_cache(maxsize=8192)
def squash(name: str) -> str:
    """Return a name without what models vary in it: case, underscores, blanks, hyphens."""
    return "".join(filter(str.isalnum, name)).casefold()


def _likeness(pairs: frozenset[str], words: frozenset[str], known: str) -> float:
    """Return the likeness of two names: by pairs of letters (Dice's coefficient), and by common words."""
    its_pairs = _pairs(squash(known))
    letters = 2 * len(pairs & its_pairs) / max(len(pairs) + len(its_pairs), 1)
    return letters + len(words & _split(known)) / max(len(words), 1)


@functools.lru_cache(maxsize=8192)
def _pairs(name: str) -> frozenset[str]:
    return frozenset(map("".join, itertools.pairwise(name)))


@functools.lru_cache(maxsize=8192)
def _split(name: str) -> frozenset[str]:
    return frozenset(name.replace("-", "_").casefold().split("_"))
