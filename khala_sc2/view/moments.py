"""A step of a match: what each agent last decided, what became of it, and what the step did.

It reads the samples that the index names: of each agent its observation, its reply and the report of the step in which
that took effect. Few chunks hold them, for agents of one step lie side by side.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, TypeVar

from khala_protocol.codec import decode_as
from khala_protocol.errors import PeerError
from khala_protocol.keys import Topic
from khala_protocol.manual import manual
from khala_protocol.messages import (
    LOOPS_PER_S,
    Briefing,
    Frames,
    Message,
    ModelCall,
    Observation,
    Reply,
    Report,
    Timings,
    Unasked,
    Usage,
    Wire,
)
from khala_protocol.speech import NOTHING_SHOWN, ShownText, thought_of
from khala_sc2.view.deeds import Screen, deeds
from khala_sc2.view.digest import tag_number
from khala_sc2.view.timeline import loop_of, whole_number
from khala_sc2.view.wire import DecisionTexts, Deed, Letter, SeenDecision, SeenTeam, SideMoment, StepView

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from khala_protocol.messages import AgentReport
    from khala_sc2.view.index import FoundSample, Index, Spot
    from khala_sc2.view.wire import AgentLine

W = TypeVar("W", bound=Wire)

SLOWEST_CALLS = 64
"""Requests to a model of one decision that are shown."""


class Moments:
    """The moments of a recording.

    Args:
        index: of the recording.
        agents: of the match, in the order of the run card.
        cells_per_unit: cells of the minimap frame per world unit.
    """

    def __init__(self, index: Index, agents: Sequence[AgentLine], cells_per_unit: float) -> None:
        self._index, self._agents, self._scale = index, agents, cells_per_unit
        self._briefings: dict[Spot, tuple[float, dict[str, tuple[str, ...]], ShownText]] = {}

    def moment(self, episode: int, step: int) -> StepView | None:
        """Return everything about a step but the map; None if there is no such step."""
        rows = self._index.rows(
            "select step, data from step where episode = ? and step <= ? order by step desc limit 2", episode, step
        )
        if not rows or rows[0][0] != step:
            return None
        row, *before = (json.loads(data) for _, data in rows)
        loop = loop_of(row, whole_number(before[0].get("after"), 0) if before else 0)
        reports = list(self._reports(episode, step))
        unasked: dict[str, Unasked] = {}
        for report in reports:
            unasked |= {f"{report.side}/{agent}": why for agent, why in report.unasked.items()}
        named = len({agent.side for agent in self._agents}) > 1
        return StepView(
            episode=episode,
            step=step,
            game_loop=loop,
            time_s=round(loop / LOOPS_PER_S, 3),
            sides=tuple(self._sides((before[0] if before else {}) | row)),
            decisions=tuple(
                found for agent in self._agents if (found := self._decision(episode, step, agent.side, agent.name))
            ),
            unasked=unasked,
            incidents=tuple(incident for report in reports for incident in report.incidents),
            functions=tuple(
                f"{report.side}: {function}" if named else function
                for report in reports for function in report.functions
            ),
            timings=reports[0].timings if reports else Timings(),
        )  # fmt: skip

    def texts(self, episode: int, step: int, side: str, agent: str) -> DecisionTexts | None:
        """Return the long texts of an agent's decision at a step, or of the last one before; None if there is none."""
        if (found := self._index.newest(Topic.OBSERVATION, episode, side, agent, step)) is None:
            return None
        if (seen := self._read(Observation, found)) is None:
            return None
        earlier = self._index.newest(Topic.OBSERVATION, episode, side, agent, found.step - 1)
        before = self._read(Observation, earlier) if earlier else None
        _, report = self._effect(episode, found.step, side, agent)
        reply = self._reply(episode, found.step, side, agent, report)
        return DecisionTexts(
            side=side,
            agent=agent,
            step=found.step,
            text=seen.text,
            before=before.text if before else None,
            reply=reply.text if reply else "",
            images=seen.images,
            calls=tuple(self._calls(episode, found.step, side, agent)),
        )

    # --- parts --------------------------------------------------------------------------------------

    def _reports(self, episode: int, step: int) -> Iterator[Report]:
        for found in self._index.at(Topic.REPORT, episode, step, step):
            if (report := self._read(Report, found)) is not None:
                yield report

    def _sides(self, row: dict[str, Any]) -> Iterator[SideMoment]:
        for side in dict.fromkeys(agent.side for agent in self._agents):
            yield SideMoment(
                side=side,
                score=row.get(f"score/{side}") or 0.0,
                killed_value=row.get(f"killed_value/{side}") or 0.0,
                lost_value=row.get(f"lost_value/{side}") or 0.0,
                tokens=int(row.get(f"tokens/{side}") or 0),
                cost_usd=row.get(f"cost_usd/{side}"),
            )

    def _decision(self, episode: int, step: int, side: str, agent: str) -> SeenDecision | None:
        if (found := self._index.newest(Topic.OBSERVATION, episode, side, agent, step)) is None:
            return None
        if (seen := self._read(Observation, found)) is None:
            return None
        effect, report = self._effect(episode, found.step, side, agent)
        reply = self._reply(episode, found.step, side, agent, report)
        text = reply.text if reply else ""
        return SeenDecision(
            side=side,
            agent=agent,
            step=seen.step,
            game_loop=seen.game_loop,
            effect_step=effect,
            status=report.status if report else reply.status if reply else None,
            detail=_why(report or reply),
            fate=report.fate if report else None,
            age_loops=report.age_loops if report else 0,
            latency_s=report.latency_s if report else reply.latency_s if reply else None,
            attempts=reply.attempts if reply else 0,
            usage=report.usage if report else reply.usage if reply else Usage(),
            model=self._model(side, agent),
            teams=tuple(self._teams(seen)),
            thought=thought_of(text),
            reply=text,
            deeds=self._deeds(text, report, seen),
            sent=tuple(self._sent(episode, effect, side, agent)),
            read=tuple(_letter(message, seen.step) for message in seen.messages),
            images=seen.images,
        )

    def _effect(self, episode: int, step: int, side: str, agent: str) -> tuple[int | None, AgentReport | None]:
        """Return the step in which a decision took effect, and its report."""
        rows = self._index.rows(
            "select effect_step from decision where episode = ? and side = ? and agent = ? and step = ?",
            episode, side, agent, step,
        )  # fmt: skip
        for (effect,) in rows:
            for report in self._reports(episode, effect):
                for decided in report.agents:
                    if (decided.side, decided.agent) == (side, agent) and step in (decided.asked_step, effect):
                        return effect, decided
        return None, None

    def _reply(self, episode: int, step: int, side: str, agent: str, report: AgentReport | None) -> Reply | None:
        """Return the reply that counted, as the report says; without a report the newest one that may yet count."""
        first: dict[int, Reply] = {}
        for found in self._index.at(Topic.REPLY, episode, step, step):
            reply = self._read(Reply, found) if (found.side, found.agent) == (side, agent) else None
            if reply is not None:
                first.setdefault(reply.rethinks, reply)
        return first.get(report.rethinks if report else max(first, default=0))

    def _calls(self, episode: int, step: int, side: str, agent: str) -> Iterator[ModelCall]:
        samples = self._index.at(Topic.EXCHANGE, episode, step, step)
        mine = [sample for sample in samples if (sample.side, sample.agent) == (side, agent)]
        for found in mine[:SLOWEST_CALLS]:
            if (call := self._read(ModelCall, found)) is not None:
                yield call

    def _sent(self, episode: int, step: int | None, side: str, agent: str) -> Iterator[Letter]:
        if step is None:
            return
        for found in self._index.at(Topic.MESSAGE, episode, step, step):
            if (found.side, found.agent) == (side, agent) and (said := self._read(Message, found)) is not None:
                yield Letter(
                    sender=said.agent, recipient=said.recipient, text=said.text, step=said.step, human=said.human
                )

    def _model(self, side: str, agent: str) -> str:
        return next((line.model for line in self._agents if (line.side, line.name) == (side, agent)), "")

    def _teams(self, seen: Observation) -> Iterator[SeenTeam]:
        size = round(self._briefing(seen)[0] * self._scale, 2)
        for team in seen.view.teams:
            tags = tuple(tag_number(unit.tag) for unit in team.units)
            yield SeenTeam(name=team.name, tags=tags, minimap=team.minimap, screen=size)

    def _deeds(self, reply: str, report: AgentReport | None, seen: Observation) -> tuple[Deed, ...]:
        cells, frames, known = self._briefing(seen)
        screens = {
            team.name: Screen(team.minimap, cells * self._scale, cells)
            for team in seen.view.teams if team.minimap is not None
        }  # fmt: skip
        shown = ShownText(seen.text, earlier=known)
        return deeds(reply, report, frames=frames, screens=screens, shown=shown)

    def _briefing(self, seen: Observation) -> tuple[float, dict[str, tuple[str, ...]], ShownText]:
        """Return the size of the screen frame, the kinds of arguments by action, and how calls are written."""
        found = self._index.newest(Topic.BRIEFING, seen.episode, seen.side, seen.agent, 0)
        if found is None:
            return Frames().screen, {}, NOTHING_SHOWN
        if found.spot not in self._briefings:
            briefing = self._read(Briefing, found)
            frames = briefing.frames if briefing else Frames()
            actions = briefing.actions if briefing else ()
            kinds: dict[str, tuple[str, ...]] = {action.name.casefold(): action.args for action in actions}
            self._briefings[found.spot] = frames.screen, kinds, ShownText(manual(actions))
        return self._briefings[found.spot]

    def _read(self, kind: type[W], found: FoundSample) -> W | None:
        """Return the message of a sample; None if it is not one of this kind: anybody may have written it."""
        try:
            return decode_as(kind, self._index.payload(found.spot))
        except PeerError:
            return None


def _why(said: AgentReport | Reply | None) -> str:
    """Return why an agent did not decide: in a few words, and in those of its endpoint."""
    return ": ".join(filter(None, (said.detail, said.reason))) if said else ""


def _letter(letter: Any, step: int) -> Letter:
    return Letter(sender=letter.sender, recipient=letter.recipient, text=letter.text, step=step, again=letter.again)
