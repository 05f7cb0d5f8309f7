"""What became of calls, by agent and action: which actions a model says, and which of them it says wrongly."""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import TYPE_CHECKING, Any

from khala_sc2.experiment.numbers import share
from khala_sc2.experiment.report.document import ReportTable

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping

MOST_ROWS = 40
MOST_REASONS = 3
ACCEPTED = "accepted"


def calls(rows: Iterable[Mapping[str, Any]], counted: Collection[str]) -> ReportTable | None:
    """Return the actions that were said most often; None if nothing was said.

    Args:
        rows: those of `Store.calls`.
        counted: keys of the matches that count.
    """
    said: dict[tuple[str, str, str], Counter[str]] = defaultdict(Counter)
    for row in rows:
        if row["match"] in counted:
            said[row["side"], row["agent"], row["action"]][row["became"]] += row["count"]
    if not said:
        return None
    sides = {side for side, _, _ in said}
    often = sorted(said.items(), key=lambda item: (-item[1].total(), item[0]))
    lines = [
        (f"{side}/{agent}" if len(sides) > 1 else agent, action, *_cells(became))
        for (side, agent, action), became in often[:MOST_ROWS]
    ]
    left = len(often) - len(lines)
    more = f" {left} further pairs of agent and action were said less often." if left else ""
    note = f"In all games together, those that were said most often.{more}"
    return ReportTable("Calls", ("agent", "action", "said", ACCEPTED, "refused because"), tuple(lines), 2, note)


def _cells(became: Counter[str]) -> tuple[str, str, str]:
    reasons = [(reason, number) for reason, number in became.most_common() if reason != ACCEPTED]
    words = ", ".join(f"{reason.replace('_', ' ')} {number}" for reason, number in reasons[:MOST_REASONS])
    return str(became.total()), share(became[ACCEPTED] / became.total(), digits=1), words
