"""A recording → one row for each observation of an agent, with what was ordered after it and what the agent saw then.

A world model learns from these rows: observation and joint orders → next observation. Both observations are those of
the agent, in the fog of war; the joint orders are those of its whole side that took effect between them. As in
SC2-Dynamics-50K of StarWM (arXiv 2602.14857), the next observation is the first one at least `horizon_s` later, and a
row is a chat of a request and an answer.

An observation waits for the next one in memory, and the orders and the fog of an episode do until it ends. Above:
`khala_sc2.dataset.export`; below: the recording, and `khala_sc2.dataset.rewards`, which says what a step was worth.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from khala_agents.prompt import Prompt
from khala_orchestrator.roster import Seat
from khala_protocol.messages import LOOPS_PER_S, Briefing, ChatMessage, Observation, Report, Scene, TokenTrace, Usage
from khala_sc2.dataset.rewards import UNKNOWN, Reward, value_of
from khala_sc2.dataset.row import NextObservation, OrderOfSide, Row, origin_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from khala_agents.detail import Detail
    from khala_protocol.messages import AgentReport, Clock, Rejection, Result, Run
    from khala_protocol.recording import Recorded, Recording


class _Told(NamedTuple):
    """A decision of an agent, when it took effect."""

    game_loop: int
    report: AgentReport


class _Seen(NamedTuple):
    """An observation, and its words as a prompt has them."""

    observation: Observation
    text: str


@dataclass(slots=True)
class _Episode:
    """What one side did and saw in the episode that is being read."""

    number: int = -1
    told: list[_Told] = field(default_factory=list)
    loops: dict[int, int] = field(default_factory=dict)
    """Game loop of each step."""
    values: dict[int, float | None] = field(default_factory=dict)
    """What each step was worth."""
    fog: dict[int, str] = field(default_factory=dict)
    """By step, as `GridView` has it."""

    def forget_from(self, step: int) -> None:
        """Forget a step and all after it: a host that was killed plays them again."""
        if step not in self.loops:
            return
        loop = self.loops[step]
        self.told = [told for told in self.told if told.game_loop < loop]
        self.loops = {at: value for at, value in self.loops.items() if at < step}
        self.values = {at: value for at, value in self.values.items() if at < step}


class Transitions:
    """The rows of one recording, in the order of the next observations.

    Args:
        recording: of a match.
        run: its run card.
        horizon_s: seconds of the game from an observation to the next one of its row, at least; 0: to the agent's next
            observation.
        detail: how much observations say.

    Attributes:
        left_out: the number of observations without a row, by the reason.
    """

    def __init__(self, recording: Recording, run: Run, *, horizon_s: float, detail: Detail | None = None) -> None:
        self.left_out: Counter[str] = Counter()
        self._recording = recording
        self._run = run
        self._horizon_loops = max(1, round(horizon_s * LOOPS_PER_S))
        self._detail: Detail = detail or "full"
        self._results: dict[tuple[str, int], Result] = {(r.side, r.episode): r for r in recording.results}
        self._prompts: dict[Seat, Prompt] = {}
        self._waiting: defaultdict[Seat, list[_Seen]] = defaultdict(list)
        self._episodes: defaultdict[str, _Episode] = defaultdict(_Episode)

    def __iter__(self) -> Iterator[Row]:
        for sample in self._recording:
            match sample.message if sample.is_of(Briefing, Observation, Report, Scene) else None:
                case Briefing() as briefing if _is_own(sample, briefing):
                    self._prompts[Seat(briefing.side, briefing.agent)] = Prompt(briefing, detail=self._detail)
                case Observation(verdict=None) as observation if _is_own(sample, observation):
                    yield from self._see(observation)
                case Report() as report:
                    self._note(report)
                case Scene() as scene:
                    for side, grid in scene.fog.items():
                        self._episode(side, scene.episode).fog[scene.step] = grid.data
        self._leave_out(self._waiting)
        self._waiting.clear()

    def _episode(self, side: str, number: int) -> _Episode:
        episode = self._episodes[side]
        if episode.number != number:
            self._leave_out(seat for seat in self._waiting if seat.side == side)
            self._episodes[side] = episode = _Episode(number)
        return episode

    def _leave_out(self, seats: Iterable[Seat]) -> None:
        for seat in list(seats):
            self.left_out["too late for a next observation"] += len(self._waiting.pop(seat, ()))

    def _see(self, observation: Observation) -> Iterator[Row]:
        seat = Seat(observation.side, observation.agent)
        prompt = self._prompts.get(seat)
        if prompt is None:
            return
        episode = self._episode(seat.side, observation.episode)
        if any(seen.observation.step >= observation.step for seen in self._waiting[seat]):
            episode.forget_from(observation.step)
        episode.loops[observation.step] = observation.game_loop
        now = _Seen(observation, prompt.draft(observation.text).messages[-1].content)
        still: list[_Seen] = []
        for seen in self._waiting[seat]:
            if seen.observation.step >= observation.step:
                continue
            if observation.game_loop - seen.observation.game_loop < self._horizon_loops:
                still.append(seen)
            else:
                yield self._row(episode, seen, now)
        self._waiting[seat] = [*still, now]

    def _note(self, report: Report) -> None:
        episode = self._episode(report.side, report.episode)
        episode.values[report.step] = value_of(report)
        for agent in report.agents:
            asked = report.step if agent.asked_step is None else agent.asked_step
            if asked in episode.loops and (agent.accepted or agent.rejections):
                episode.told.append(_Told(episode.loops[asked] + agent.age_loops, agent))

    def _row(self, episode: _Episode, seen: _Seen, following: _Seen) -> Row:
        before = seen.observation
        after = following.observation
        told = [told for told in episode.told if before.game_loop <= told.game_loop < after.game_loop]
        orders = tuple(
            OrderOfSide(told.game_loop, told.report.agent, action) for told in told for action in told.report.accepted
        )
        rejections: tuple[Rejection, ...] = tuple(refused for told in told for refused in told.report.rejections)
        result = self._results.get((before.side, before.episode))
        return Row(
            **origin_of(self._run, before, result),
            prompt=request(seen.text, orders, before, after, self._run.clock),
            prompt_recorded=False,
            example=0,
            pictures=(),
            reply=following.text,
            status="ok" if all(told.report.status == "ok" for told in told) else "fallback",
            model="",
            usage=Usage(),
            accepted=tuple(order.action for order in orders),
            rejections=rejections,
            fate=None,
            age_loops=0,
            reward=_reward(episode, range(before.step, after.step)),
            own_reward=UNKNOWN,
            tokens=TokenTrace(),
            following=NextObservation(
                step=after.step,
                game_loop=after.game_loop,
                observation=seen.text,
                orders=orders,
                clock=self._run.clock,
                fog=episode.fog.get(before.step),
                view=before.view,
                next_view=after.view,
            ),
        )


def _is_own(sample: Recorded, said: Briefing | Observation) -> bool:
    """Return whether a message does not stand under the key of another agent."""
    return sample.address is not None and (sample.address.side, sample.address.agent) == (said.side, said.agent)


def _reward(episode: _Episode, steps: range) -> Reward:
    values = [episode.values.get(step) for step in steps]
    known = [value for value in values if value is not None]
    return Reward(sum(known), None) if len(known) == len(values) else UNKNOWN


def request(
    text: str, orders: Sequence[OrderOfSide], before: Observation, after: Observation, clock: Clock
) -> tuple[ChatMessage, ...]:
    """Return the prompt of a world model.

    Args:
        text: the observation.
        orders: of the side, between the two observations.
        before: what the agent saw.
        after: what the agent sees next; only its time is told.
        clock: of the match.
    """
    loops = after.game_loop - before.game_loop
    system = (
        "You predict a game of StarCraft II. You get an observation of one agent, which sees through the fog of war "
        "only what its side sees, and the orders that its side gives after it. Answer with the agent's next "
        "observation in the same form, and nothing else."
    )
    lines = [
        f"Agent: {before.agent}, side {before.side}",
        f"Clock: {clock.rule}, {clock.step_loops} game loops from a decision to the next observation",
        f"Observation at game loop {before.game_loop}:",
        text.rstrip(),
        "Orders of the side after it:",
        *map(partial(_order_line, start=before.game_loop), orders),
        *([] if orders else ["    none: all units go on with what they do"]),
        f"Next observation: {loops / LOOPS_PER_S:.2f} s later, at game loop {after.game_loop}",
    ]
    return (ChatMessage(role="system", content=system), ChatMessage(role="user", content="\n".join(lines)))


def _order_line(order: OrderOfSide, *, start: int) -> str:
    return f"    after {(order.game_loop - start) / LOOPS_PER_S:.2f} s, {order.agent}: {order.action}"
