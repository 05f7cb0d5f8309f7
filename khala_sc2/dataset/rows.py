"""A recording → one row for each decision of an agent whose reply counted.

A row is complete when the report of its decision came, and, if its agent asked a model, the request: requests travel
on their own topic and may arrive some steps later. Until then rows wait, a bounded number of them. Above:
`khala_sc2.dataset.export`; below: the recording, `khala_sc2.dataset.rewards` and `khala_sc2.dataset.prompts`.
"""

from __future__ import annotations

from collections import Counter, OrderedDict, defaultdict
from dataclasses import dataclass, field
from functools import partial
from hashlib import sha256
from typing import TYPE_CHECKING, NamedTuple

from khala_orchestrator.roster import Seat
from khala_protocol.files import MB
from khala_protocol.keys import Topic
from khala_protocol.messages import Briefing, ModelCall, Observation, Reply, Report, TokenTrace
from khala_sc2.dataset.credit import own_rewards
from khala_sc2.dataset.prompts import Prompter, count_example
from khala_sc2.dataset.rewards import COUNTED, UNKNOWN, rewards
from khala_sc2.dataset.row import Row, RowPicture, origin_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from khala_agents.detail import Detail
    from khala_protocol.messages import AgentReport, ChatMessage, Result, Run
    from khala_protocol.recording import Recorded, Recording

MOST_WAITING = 64
"""Rows that wait for the request of their decision; of more, the oldest gets a prompt that is made again."""
MOST_PICTURE_BYTES = 64 * MB
"""Pictures that are kept for observations to come. A picture is published just before the observation with it."""
_READ = frozenset({Topic.BRIEFING, Topic.OBSERVATION, Topic.REPLY, Topic.EXCHANGE, Topic.REPORT})


class DecisionPlace(NamedTuple):
    """Which decision of a run it is."""

    seat: Seat
    episode: int
    step: int


@dataclass(slots=True)
class _Open:
    """A decision on its way."""

    seen: Observation
    prompt: tuple[ChatMessage, ...]
    """As it is made of briefing and observation."""
    example: Sequence[ChatMessage]
    """Of the briefing."""
    pictures: dict[str, bytes]
    replies: dict[int, Reply] = field(default_factory=dict)
    """By the number of the verdict that it answers, 0 for none."""
    reply: Reply | None = None
    """The one that counts, once there is a report."""
    call: ModelCall | None = None
    """The request whose answer it is: the newest one, or the newest that was answered."""
    attempts: int = 0
    report: AgentReport | None = None

    @property
    def is_complete(self) -> bool:
        if self.reply is None or self.reply.attempts == 0:
            return True
        is_answer = self.call is not None and self.call.status == "ok" and not self.reply.rethinks
        return is_answer or self.attempts >= self.reply.attempts


@dataclass(slots=True)
class _Pictures:
    """The newest pictures by their hashes."""

    kept: OrderedDict[str, bytes] = field(default_factory=OrderedDict)
    size: int = 0

    def put(self, data: bytes) -> None:
        digest = sha256(data).hexdigest()
        if digest in self.kept:
            self.kept.move_to_end(digest)
            return
        self.kept[digest] = data
        self.size += len(data)
        while self.size > MOST_PICTURE_BYTES:
            self.size -= len(self.kept.popitem(last=False)[1])


class Rows:
    """The rows of one recording, in the order in which their decisions were reported.

    Args:
        recording: of a match; it is read three times.
        run: its run card.
        gamma: discount of the reward-to-go.
        images: whether rows have their pictures.
        detail: how much prompts say; None for what they said when they were sent.

    Attributes:
        left_out: the number of decisions without a row, by the reason.
    """

    def __init__(
        self,
        recording: Recording,
        run: Run,
        *,
        gamma: float = 0.99,
        images: bool = True,
        detail: Detail | None = None,
    ) -> None:
        self.left_out: Counter[str] = Counter()
        self._recording, self._run, self._images = recording, run, images
        self._rewards = rewards(recording, gamma)
        self._own_rewards = own_rewards(recording, gamma)
        self._results: dict[tuple[str, int], Result] = {(r.side, r.episode): r for r in recording.results}
        self._as_sent = detail is None
        self._prompters: dict[Seat, Prompter] = defaultdict(partial(Prompter, detail or "full"))
        self._briefings: dict[Seat, Briefing] = {}
        self._pictures = _Pictures()
        self._open: dict[DecisionPlace, _Open] = {}
        self._settled: dict[DecisionPlace, _Open] = {}

    def __iter__(self) -> Iterator[Row]:
        for sample in self._recording:
            self._take(sample)
            yield from self._ready()
        yield from map(self._row, self._settled.values())
        self._settled = {}
        self.left_out["no report"] += len(self._open)

    def _take(self, sample: Recorded) -> None:
        address = sample.address
        if address is None:
            return
        if address.topic is Topic.IMAGE and self._images:
            self._pictures.put(sample.payload)
        if address.topic not in _READ:
            return
        match sample.message:
            case Report() as report:
                self._settle(report)
            case Briefing() | Observation() | Reply() | ModelCall() as said:
                seat = Seat(said.side, said.agent)
                if seat == (address.side, address.agent):  # not under the key of another agent
                    self._note(seat, said)

    def _note(self, seat: Seat, said: Briefing | Observation | Reply | ModelCall) -> None:
        match said:
            case Briefing():
                self._briefings[seat] = said
            case Observation():
                self._ask(seat, said)
            case Reply():
                self._answer(DecisionPlace(seat, said.episode, said.step), said)
            case ModelCall(purpose="decision"):
                place = DecisionPlace(seat, said.episode, said.step)
                if decision := self._open.get(place) or self._settled.get(place):
                    decision.attempts = max(decision.attempts, said.attempt)
                    if said.status == "ok" or decision.call is None or decision.call.status != "ok":
                        decision.call = said

    def _ask(self, seat: Seat, seen: Observation) -> None:
        """Open a decision. A host that goes on after it was killed asks again; what came before was lost with it."""
        briefing = self._briefings.get(seat)
        if briefing is None or seen.verdict is not None:
            return
        found = {ref.sha256: self._pictures.kept.get(ref.sha256) for ref in seen.images}
        pictures = {digest: data for digest, data in found.items() if data is not None}
        prompter = self._prompters[seat]
        prompt = prompter.messages(briefing, seen)
        place = DecisionPlace(seat, seen.episode, seen.step)
        self._open[place] = _Open(seen, prompt, prompter.example, pictures)

    def _answer(self, place: DecisionPlace, reply: Reply) -> None:
        decision = self._open.get(place)
        if decision is not None:
            decision.replies.setdefault(reply.rethinks, reply)

    def _settle(self, report: Report) -> None:
        for agent in report.agents:
            asked = report.step if agent.asked_step is None else agent.asked_step
            place = DecisionPlace(Seat(agent.side, agent.agent), report.episode, asked)
            decision = self._open.pop(place, None)
            if decision is not None:
                decision.reply = decision.replies.get(agent.rethinks)
                if decision.reply is not None and decision.reply.status == "ok":
                    self._prompters[place.seat].remember(decision.seen, decision.reply.text)
            if agent.status not in COUNTED:
                self.left_out[agent.status] += 1
            elif decision is None or decision.reply is None:
                self.left_out["not recorded"] += 1
            elif not decision.reply.text.strip():
                self.left_out["no words"] += 1
            else:
                decision.report = agent
                self._settled[place] = decision

    def _ready(self) -> Iterator[Row]:
        for place in [place for place, decision in self._settled.items() if decision.is_complete]:
            yield self._row(self._settled.pop(place))
        while len(self._settled) > MOST_WAITING:
            yield self._row(self._settled.pop(next(iter(self._settled))))

    def _prompt(self, decision: _Open) -> tuple[ChatMessage, ...]:
        """Return the prompt of a row: the recorded one if there is one, and no detail is asked for."""
        return decision.call.prompt if decision.call is not None and self._as_sent else decision.prompt

    def _row(self, decision: _Open) -> Row:
        seen, reply, report, call = decision.seen, decision.reply, decision.report, decision.call
        assert reply is not None and report is not None
        prompt = self._prompt(decision)
        answered = call is not None and reply.status == "ok"
        reward = self._rewards.get((seen.side, seen.episode), {}).get(seen.step, UNKNOWN)
        place = DecisionPlace(Seat(seen.side, seen.agent), seen.episode, seen.step)
        result = self._results.get((seen.side, seen.episode))
        shown = [ref for message in prompt for ref in message.images if ref.sha256 in decision.pictures]
        return Row(
            **origin_of(self._run, seen, result),
            prompt=prompt,
            prompt_recorded=call is not None and self._as_sent,
            example=count_example(prompt, decision.example),
            pictures=tuple(RowPicture(ref, decision.pictures[ref.sha256]) for ref in shown),
            reply=reply.text,
            status=reply.status,
            model=_model_of(call, reply),
            usage=reply.usage,
            accepted=report.accepted,
            rejections=report.rejections,
            fate=report.fate,
            age_loops=report.age_loops,
            reward=reward,
            own_reward=UNKNOWN if reward.reward is None else self._own_rewards.get(place, UNKNOWN),
            tokens=(call.tokens if call is not None and answered else None) or TokenTrace(),
        )


def _model_of(call: ModelCall | None, reply: Reply) -> str:
    """Return what gave a reply: a model, `human` for a person, "" for neither."""
    if reply.human:
        return "human"
    return (call.answered_by or call.model) if call is not None and reply.status == "ok" else ""
