"""Refusals that an agent gets again and again: from the third on the sentence says so, and what else there is.

A model that orders what was refused reads the same sentence again, and orders it again: one did so 92 times in a game.
`khala_orchestrator.match.side` is above.
"""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from khala_protocol.messages import Rejection

OFTEN = 3
"""Refusals in a row from which on the sentence says more."""
MOST_OFFERS = 6
"""Actions that it names."""
Key: TypeAlias = tuple[str | None, str, str]


class Repeats:
    """How often in a row each agent of a side was refused the same call for the same reason."""

    def __init__(self) -> None:
        self._counts: dict[str, dict[Key, int]] = defaultdict(dict)

    def clear(self) -> None:
        """Forget the episode before."""
        self._counts.clear()

    def counted(
        self, agent: str, rejections: Iterable[Rejection], offers: Mapping[str, Sequence[str]]
    ) -> tuple[Rejection, ...]:
        """Return the rejections of an agent's decision, with more to read where they repeat.

        Args:
            agent: its name; a decision without a refusal ends the row.
            rejections: of all its calls in the decision.
            offers: by team, the actions that were possible when it decided.
        """
        found = tuple(rejections)
        before = self._counts[agent]
        self._counts[agent] = {key: before.get(key, 0) + 1 for key in map(_key, found)}
        return tuple(_said_again(one, self._counts[agent][_key(one)], offers) for one in found)


def _key(rejection: Rejection) -> Key:
    """Return what makes two refusals the same: the call; for one that is not possible now, its action."""
    call = rejection.text.partition("(")[0] if rejection.reason == "not_available" else rejection.text
    return rejection.team, call, rejection.reason


def _said_again(rejection: Rejection, times: int, offers: Mapping[str, Sequence[str]]) -> Rejection:
    if times < OFTEN or not rejection.text:
        return rejection
    names = offers.get(rejection.team or "") or [name for its in offers.values() for name in its]
    others = [name for name in dict.fromkeys(names) if f"<{name}(" not in rejection.text][:MOST_OFFERS]
    instead = f"; possible now: {', '.join(others)}" if others else ""
    more = f"Refused {times} times in a row for the same reason{instead}."
    return rejection.but(message=f"{rejection.message} {more}")
