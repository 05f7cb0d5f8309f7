"""A reply → its calls and what became of them, with the places that they name in the minimap frame.

The reader of replies says what the calls are, the report of the step in which they took effect what became of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from khala_protocol.speech import NOTHING_SHOWN, ShownText, Standing, parse
from khala_sc2.view.wire import Deed

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from khala_protocol.messages import AgentReport, Call, Point, Rejection


class Screen(NamedTuple):
    """The screen of a team: where it is on the minimap, and how large."""

    middle: Point
    size: float
    """In cells of the minimap."""
    cells: float
    """In cells of the screen frame."""

    def minimap(self, point: Point) -> Point:
        """Return the place of a point of the screen frame on the minimap."""
        scale = self.size / self.cells
        x, y = ((place - self.cells / 2) * scale for place in point)
        return round(self.middle[0] + x, 2), round(self.middle[1] + y, 2)


def deeds(
    reply: str,
    report: AgentReport | None,
    *,
    frames: Mapping[str, Sequence[str]],
    screens: Mapping[str, Screen],
    shown: ShownText = NOTHING_SHOWN,
) -> tuple[Deed, ...]:
    """Return the calls of a reply, in the order of the text.

    Args:
        reply: its words.
        report: of the step in which it took effect; None if that has not happened.
        frames: by action, the kinds of its arguments.
        screens: by team.
        shown: what its agent had read; what repeats it is no call.
    """
    speech = parse(reply, shown)
    standing = [(order.call, order.start, order.end) for order in speech.standing if isinstance(order, Standing)]
    calls = sorted([*((call, call.start, call.end) for call in speech.calls), *standing], key=lambda call: call[1])
    rejections = list(report.rejections) if report else []
    accepted = list(report.accepted) if report else []
    unread = max(
        (rejection for rejection in rejections if rejection.reason == "too_many_actions"),
        key=lambda rejection: rejection.start,
        default=None,
    )
    found: list[Deed] = []
    for call, start, end in calls:
        why = _taken(rejections, start, end)
        ok = None
        if why is None and (ok := _was_accepted(call, accepted)) is None and unread and start > unread.start:
            why = unread  # one rejection stands for all calls behind it
        found.append(_deed(reply[start:end], call, start, False if why else ok, why, frames, screens))
    found += (_refused_deed(rejection) for rejection in rejections if rejection.text)
    return tuple(sorted(found, key=lambda deed: deed.start))


def _taken(rejections: list[Rejection], start: int, end: int) -> Rejection | None:
    """Return the rejection of the call at this place, and take it from the list."""
    mine = next((rejection for rejection in rejections if start <= rejection.start < end), None)
    if mine is not None:
        rejections.remove(mine)
    return mine


def _was_accepted(call: Call, accepted: list[str]) -> bool | None:
    """Return whether one of the texts that were accepted is of this call, and take those that are from the list.

    A call may be for several teams, and then stands there once for each.
    """
    name = f"{_plain(call.name)}("
    mine = [text for text in accepted if name in _plain(text)]
    for text in mine[:1]:
        accepted.remove(text)
    return True if mine else None


def _plain(text: str) -> str:
    """Return a name as it is compared: models write it in any case, and some leave underscores out."""
    return text.casefold().replace("_", "").replace(" ", "")


def _deed(
    text: str,
    call: Call,
    start: int,
    accepted: bool | None,
    why: Rejection | None,
    frames: Mapping[str, Sequence[str]],
    screens: Mapping[str, Screen],
) -> Deed:
    team = call.team or ""
    return Deed(
        text=text,
        start=start,
        team=team,
        accepted=accepted,
        reason=why.reason if why else None,
        message=why.message if why else "",
        tags=tuple(_tags(call)),
        at=_place(call, frames.get(call.name.casefold(), ()), screens.get(team) or _only(screens)),
    )


def _refused_deed(rejection: Rejection) -> Deed:
    return Deed(
        text=rejection.text,
        start=rejection.start,
        team=rejection.team or "",
        accepted=False,
        reason=rejection.reason,
        message=rejection.message,
    )


def _tags(call: Call) -> Iterator[int]:
    for arg in call.args:
        if isinstance(arg, str) and arg.startswith("0x"):
            try:
                yield int(arg, 16)
            except ValueError:
                continue


def _place(call: Call, kinds: Sequence[str], screen: Screen | None) -> Point | None:
    """Return the last point of a call on the minimap; None if it has none, or the screen is not known."""
    points = [arg for arg in call.args if not isinstance(arg, str)]
    if not points:
        return None
    wanted = [kind for kind in kinds if kind != "tag"] or ["minimap" if "minimap" in call.name.casefold() else "screen"]
    if wanted[-1] == "minimap":
        return points[-1]
    return screen.minimap(points[-1]) if screen is not None else None


def _only(screens: Mapping[str, Screen]) -> Screen | None:
    return next(iter(screens.values())) if len(screens) == 1 else None
