"""Who is asked when, and when a decision takes effect: the rules of the clock, counted in game loops.

    frozen     a decision takes effect at the loop of its observation
    budget     a fixed number of loops later
    token      as many loops later as its tokens took, by the pace of its model
    realtime   when it arrives: the game did not wait

Then the agent's orders play out for `Clock.step_loops`, and it is asked again, unless its `every_loops` and `when`
put that off, or it has nothing to decide. So one agent's slowness costs another nothing. A schedule counts; it asks
nobody and plays nothing: `khala_orchestrator.match.match` does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from khala_orchestrator.match.turn import Answer
from khala_protocol.messages import LOOPS_PER_S

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    from khala_orchestrator.roster import Seat
    from khala_protocol.messages import Clock, Trigger, Unasked


UNANSWERED = "no reply before the episode ended"
"""Why an agent did not decide that still thought at the end."""


class StepId(NamedTuple):
    """One step of a run."""

    episode: int
    step: int


class Cadence(NamedTuple):
    """When a free agent is asked: after `every_loops`, or as soon as one of `when` happened; always if both are empty.

    Both count from its observation before.
    """

    every_loops: int = 0
    when: tuple[Trigger, ...] = ()

    def is_due(self, waited_loops: int, happened: Callable[[], Collection[Trigger]]) -> bool:
        """Return whether it is time to ask; `happened` is called only if that decides."""
        if not self.when:
            return waited_loops >= self.every_loops
        return bool(self.every_loops and waited_loops >= self.every_loops) or not set(self.when).isdisjoint(happened())


@dataclass(frozen=True, slots=True)
class Decision:
    """An answer that has taken effect, or has yet to.

    Attributes:
        asked: the step of its observation.
        asked_loop: the game loop of its observation.
        due_loop: the game loop at which it takes effect.
    """

    seat: Seat
    answer: Answer
    asked: StepId
    asked_loop: int
    due_loop: int


class SeatChoice(NamedTuple):
    """Who is asked in a step, in the order of the match, and why other free agents are not."""

    seats: Sequence[Seat]
    unasked: Mapping[Seat, Unasked]


@dataclass(slots=True)
class _Place:
    """Where one agent is in its round of being asked, deciding, and waiting for its orders to play out."""

    cadence: Cadence
    next_loop: int = 0
    """From this loop on it may be asked."""
    asked: tuple[StepId, int] | None = None
    """Step and loop of its newest observation; None before its first one of the episode."""
    thinks: bool = False
    decided: Decision | None = None
    """A decision that waits for its loop."""

    @property
    def is_free(self) -> bool:
        return not self.thinks and self.decided is None


@dataclass
class Schedule:
    """The schedule of all agents of a match."""

    clock: Clock
    cadences: Mapping[Seat, Cadence]
    _places: dict[Seat, _Place] = field(init=False, default_factory=dict)

    def begin(self) -> None:
        """Begin an episode: every agent is free, and asked at once."""
        self._places = {seat: _Place(cadence) for seat, cadence in self.cadences.items()}

    def choose(
        self,
        at: StepId,
        loop: int,
        happened: Callable[[Seat], Collection[Trigger]],
        is_needed: Callable[[Seat], bool] = lambda _: True,
    ) -> SeatChoice:
        """Choose the agents to ask now, which think from now on; say why the other free agents are not asked.

        Args:
            at: the present step.
            loop: the present game loop.
            happened: what happened to an agent since its last observation.
            is_needed: whether an agent has anything to decide.
        """
        free = [seat for seat, place in self._places.items() if place.is_free and loop >= place.next_loop]
        due = [seat for seat in free if self._is_due(seat, loop, happened)]
        asked = [seat for seat in due if is_needed(seat)]
        for seat in asked:
            self._places[seat].asked = (at, loop)
            self._places[seat].thinks = True
        return SeatChoice(asked, {seat: "no_units" if seat in due else "not_due" for seat in free if seat not in asked})

    def decide(self, answers: Mapping[Seat, Answer], loop: int) -> None:
        """Take the answers that arrived by this loop."""
        for seat, answer in answers.items():
            place = self._places[seat]
            assert place.asked is not None and place.thinks, f"{seat} was not asked"
            asked, asked_loop = place.asked
            due_loop = loop if self.clock.rule == "realtime" else asked_loop + loops_to_think(self.clock, answer)
            place.thinks = False
            place.decided = Decision(seat, answer, asked, asked_loop, due_loop)

    def take_due(self, loop: int) -> Sequence[Decision]:
        """Take the decisions that take effect now, in the order of the match; their agents are free afterwards."""
        due = [p.decided for p in self._places.values() if p.decided is not None and p.decided.due_loop <= loop]
        for decision in due:
            place = self._places[decision.seat]
            place.decided = None
            place.next_loop = loop + self.clock.step_loops
        return due

    def loops(self, loop: int) -> int:
        """Return the game loops until something may happen again: a decision takes effect, or an agent can be asked."""
        moments = [loop + self.clock.step_loops]
        for place in self._places.values():
            if place.decided is not None:
                moments.append(place.decided.due_loop)
            elif place.is_free and place.next_loop > loop:
                moments.append(place.next_loop)
        return min(moments) - loop

    def drop(self, loop: int) -> Sequence[Decision]:
        """Return the decisions that can no longer take effect at the end of an episode, and those that nobody made."""
        found = []
        for seat, place in self._places.items():
            if place.decided is not None:
                found.append(place.decided)
            elif place.thinks and place.asked is not None:
                found.append(Decision(seat, Answer("late", detail=UNANSWERED), *place.asked, loop))
        return found

    def _is_due(self, seat: Seat, loop: int, happened: Callable[[Seat], Collection[Trigger]]) -> bool:
        place = self._places[seat]
        return place.asked is None or place.cadence.is_due(loop - place.asked[1], lambda: happened(seat))


def loops_to_think(clock: Clock, answer: Answer) -> int:
    """Return the game loops from an observation to the effect of its answer, by a rule that waits for answers."""
    match clock.rule:
        case "budget":
            return clock.thinking_loops
        case "token":
            pace = answer.reply.pace if answer.reply and answer.reply.pace else clock.pace
            return math.ceil(pace.seconds(answer.usage) * LOOPS_PER_S)
        case "frozen" | "realtime":
            return 0
