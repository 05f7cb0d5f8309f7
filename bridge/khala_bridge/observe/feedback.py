"""The results of an agent's last reply, as its next observation has them: a bounded part of what was said.

A reply of 64 kB may hold thousands of wrong calls. The observation, and with it the next prompt, has the first few and
the number of the others, and so has the report of the step: the recording has the whole reply, from which
`khala_protocol.speech.parse` reads all of them again.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from khala_protocol.messages import count_refusals

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala_protocol.messages import CastView, NoteView, Received, Rejection

MAX_REJECTIONS = 10
"""Rejections that an observation lists; the others are counted."""
MAX_CHARACTERS = 1_500
"""Characters of all rejections that an observation lists. The shortest observation of a task has 1 900."""
_LONGEST_TEXT, _LONGEST_MESSAGE, _LONGEST_TEAM = 120, 400, 60


@dataclass(frozen=True, slots=True)
class Feedback:
    """The results of an agent's last reply, the messages of others, and what stays from step to step."""

    accepted: tuple[str, ...] = ()
    """Its calls that were carried out, `Stalker-1 <Attack_Unit(0x1)>`."""
    rejections: tuple[Rejection, ...] = ()
    messages: tuple[Received, ...] = ()
    ordered: bool = False
    """Whether it gave an order or wrote a message."""
    notes: tuple[NoteView, ...] = ()
    """All of its notes."""
    casts: tuple[CastView, ...] = ()
    """What became of its casts, of the newest calls last."""


def shorten(rejections: Sequence[Rejection]) -> tuple[Rejection, ...]:
    """Return the first rejections, as far as they fit, and one that counts the others by their reasons.

    Of rejections that say the same of the same call, the first stands for all.
    """
    rejections = tuple(_without_repeats(rejections))
    listed = tuple(_first(rejections))
    others = count_refusals(rejections[len(listed) :])
    if not others:
        return listed
    counts = ", ".join(f"{number} {reason}" for reason, number in others.most_common())
    message = f"{others.total()} more are not listed: {counts}."
    ((reason, _),) = others.most_common(1)
    return *listed, rejections[len(listed)].but(reason=reason, message=message, text="", team=None, others=dict(others))


def _without_repeats(rejections: Iterable[Rejection]) -> Iterator[Rejection]:
    same: dict[tuple[object, ...], list[Rejection]] = {}
    for rejection in rejections:
        same.setdefault((rejection.reason, rejection.text, rejection.message, rejection.team), []).append(rejection)
    for first, *more in same.values():
        count = 1 + len(more)
        said = {"message": f"{first.message} (so {count} times in this answer)", "others": {first.reason: count}}
        yield first.but(**said) if more else first


def _first(rejections: Sequence[Rejection]) -> Iterator[Rejection]:
    """Yield the rejections that an observation lists, at least one, each cut to a length."""
    room = MAX_CHARACTERS
    for place, rejection in enumerate(rejections[:MAX_REJECTIONS]):
        short = rejection.but(
            text=_cut(rejection.text, _LONGEST_TEXT),
            message=_cut(rejection.message, _LONGEST_MESSAGE),
            team=rejection.team and _cut(rejection.team, _LONGEST_TEAM),
        )
        room -= len(short.text) + len(short.message) + len(short.team or "")
        if room < 0 and place:
            return
        yield short


def _cut(text: str, longest: int) -> str:
    return text if len(text) <= longest else text[: longest - 1] + "…"
