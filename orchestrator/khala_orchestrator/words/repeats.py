"""Refusals that an agent gets again and again: from the third on the sentence says so, and what else there was.

A model that orders what was refused reads the same sentence again, and orders it again: one did so 92 times in a game.
`khala_orchestrator.match.side` is above.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from khala_protocol.messages import Rejection

OFTEN = 3
"""Refusals in a row from which on the sentence says more."""
MOST_OFFERS = 6
"""Actions that it names."""
Key: TypeAlias = tuple[str | None, str, str]


class Repeats:
    """How often in a row an agent was refused the same call for the same reason."""

    def __init__(self) -> None:
        self._counts: dict[Key, int] = {}

    def annotate(self, rejections: Sequence[Rejection], offers: Mapping[str, Sequence[str]]) -> tuple[Rejection, ...]:
        """Count the rejections of a decision, and return them with more to read where they repeat.

        Args:
            rejections: of all calls in the decision; a decision without one ends the row.
            offers: by team, the actions that were possible when the agent decided. Those of which a call is refused now
                are not recommended in place of another one.
        """
        self._counts = {key: self._counts.get(key, 0) + 1 for key in map(_key, rejections)}
        refused = {(rejection.team, _name_of(rejection)) for rejection in rejections}
        left = {team: [name for name in names if (team, name) not in refused] for team, names in offers.items()}
        return tuple(_with_count(rejection, self._counts[_key(rejection)], left) for rejection in rejections)


def _key(rejection: Rejection) -> Key:
    """Return what makes two refusals the same: the call; for one that is not possible now, its action."""
    call = rejection.text.partition("(")[0] if rejection.reason == "not_available" else rejection.text
    return rejection.team, call, rejection.reason


def _name_of(rejection: Rejection) -> str:
    return rejection.text.partition("(")[0].lstrip("<")


def _with_count(rejection: Rejection, times: int, offers: Mapping[str, Sequence[str]]) -> Rejection:
    if times < OFTEN or not rejection.text:
        return rejection
    names = offers.get(rejection.team or "") or [name for its in offers.values() for name in its]
    others = list(dict.fromkeys(name for name in names if name != _name_of(rejection)))[:MOST_OFFERS]
    instead = f"; what was possible: {', '.join(others)}" if others else ""
    more = f"Refused {times} times in a row for the same reason{instead}."
    return rejection.but(message=f"{rejection.message} {more}")
