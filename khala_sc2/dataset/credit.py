"""What each agent's decisions were worth, from what a match says of its steps: parts, their sum, and what came after.

    turns = credit(recording)["blue", 0]                       what happened in each turn of each agent
    rewards = [own_reward(turn) for turn in turns]             one number a turn: `with_weights` makes others
    returns = rewards_to_go(rewards_of_an_agent, gamma=0.99)   with all that came after
    advantages(returns_of_the_group)                           compared with other plays of the same game

A *turn* of an agent begins with an observation that it answered, and ends with the next one that it answers, or with
the episode. All here are plain functions over `AgentTurn`: a reward is any function of a turn, a baseline is any
function of the returns of a group.

Own kills and losses share out what the host reports of the side, so that over an episode and all agents they sum up to
the values of its result, if every agent decided before the first unit died:

    killed(a) = killed(side) · weight(a) / weight(all agents)

where the weight is the price of the enemies that died in sight of the agents: each goes to those whose units had it as
their target, by the number of these units, or else to those whose teams saw it die. Losses go by the price of the dead
of an agent's own teams. What nobody saw, such as the last blow of a battle, is shared by the price of the units that
each agent had.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass
from functools import partial
from statistics import fmean, pstdev
from typing import TYPE_CHECKING, Final, TypeAlias

from khala_bridge.knowledge import knowledge
from khala_orchestrator.roster import Seat
from khala_protocol.messages import Observation, Report, count_refusals
from khala_sc2.dataset.heeding import is_acted_on, tags
from khala_sc2.dataset.rewards import COUNTED, VALUE, WIN, Reward, rewards_to_go

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

    from khala_protocol.messages import AgentReport, Ending, Event, Result, UnitView
    from khala_protocol.recording import Recording

__all__ = [
    "PARTS",
    "WEIGHTS",
    "AgentTurn",
    "CreditBook",
    "advantages",
    "by_agent",
    "credit",
    "group_mean",
    "leave_one_out",
    "own_reward",
    "own_rewards",
    "rewards_to_go",
    "with_weights",
]
ROUNDING = 1e-9
"""No spread of returns that are alike is wider."""


@dataclass(slots=True)
class AgentTurn:
    """What happened in one turn of an agent.

    Attributes:
        agent: its name.
        step: of the observation that it answered.
        killed: minerals and vespene of its share in what the side destroyed.
        lost: minerals and vespene of its share in what the side lost.
        accepted: its calls that were carried out.
        refused: its calls that were not.
        sent: messages that it wrote to other agents.
        heeded: of these, those after which a reader gave a new order that names what the message names.
        ending: how the episode ended, in the last turn of each agent; None before.
    """

    agent: str
    step: int
    killed: float = 0.0
    lost: float = 0.0
    accepted: int = 0
    refused: int = 0
    sent: int = 0
    heeded: int = 0
    ending: Ending | None = None


TurnReward: TypeAlias = "Callable[[AgentTurn], float]"
Baseline: TypeAlias = "Callable[[Sequence[float]], Sequence[float]]"


def kills(turn: AgentTurn) -> float:
    """Return what it destroyed, in thousands of minerals and vespene."""
    return turn.killed / VALUE


def losses(turn: AgentTurn) -> float:
    """Return minus what it lost, in thousands of minerals and vespene."""
    return -turn.lost / VALUE


def objective(turn: AgentTurn) -> float:
    """Return 1 for a win and -1 for a loss, in the last turn of each agent; else 0."""
    return {"win": WIN, "loss": -WIN}.get(turn.ending or "", 0.0)


def legality(turn: AgentTurn) -> float:
    """Return minus the share of its calls that were refused: 0 if none was, and if there were none."""
    calls = turn.accepted + turn.refused
    return -turn.refused / calls if calls else 0.0


def messages(turn: AgentTurn) -> float:
    """Return the share of its messages that were acted on; 0 if it wrote none."""
    return turn.heeded / turn.sent if turn.sent else 0.0


PARTS: Final[Mapping[str, TurnReward]] = {
    "kills": kills,
    "losses": losses,
    "objective": objective,
    "legality": legality,
    "messages": messages,
}


WEIGHTS: Final[Mapping[str, float]] = {
    "kills": 1.0,
    "losses": 1.0,
    "objective": 1.0,
    "legality": 0.1,
    "messages": 0.05,
}


def with_weights(**weights: float) -> TurnReward:
    """Return the reward that is the sum of the parts, each with a weight: that of `WEIGHTS`, or the given one.

    Raises:
        ValueError: there is no such part.
    """
    if unknown := sorted(weights.keys() - PARTS.keys()):
        raise ValueError(f"a reward has no part {unknown[0]!r}: its parts are {', '.join(PARTS)}")
    return partial(_weigh, {**WEIGHTS, **weights})


def _weigh(weights: Mapping[str, float], turn: AgentTurn) -> float:
    return sum(weight * PARTS[name](turn) for name, weight in weights.items())


own_reward: Final = with_weights()
"""The reward of a turn if none is given."""


def group_mean(returns: Sequence[float]) -> list[float]:
    """Return, for each of a group, the mean of the group: the baseline of GRPO."""
    return [fmean(returns)] * len(returns)


def leave_one_out(returns: Sequence[float]) -> list[float]:
    """Return, for each of a group, the mean of the others, or 0 without others: the baseline of RLOO."""
    others = len(returns) - 1
    whole = sum(returns)
    return [(whole - own) / others if others else 0.0 for own in returns]


def advantages(returns: Sequence[float], baseline: Baseline = group_mean, *, scaled: bool = False) -> list[float]:
    """Return the returns of a group minus their baseline.

    Args:
        returns: of plays that began alike: the same task and seed, and the same agent.
        baseline: of each return.
        scaled: whether to divide by the standard deviation of the group, as GRPO does; all 0 if that is nothing.
    """
    above = [own - base for own, base in zip(returns, baseline(returns), strict=True)]
    if not scaled:
        return above
    spread = pstdev(returns)
    return [each / spread if spread > ROUNDING else 0.0 for each in above]


def by_agent(turns: Sequence[AgentTurn]) -> dict[str, list[AgentTurn]]:
    """Return turns by agent, each agent's in their order."""
    found: dict[str, list[AgentTurn]] = {}
    for turn in turns:
        found.setdefault(turn.agent, []).append(turn)
    return found


def credit(recording: Recording) -> dict[tuple[str, int], list[AgentTurn]]:
    """Return the turns of a recording by side and episode, in the order of their decisions."""
    return dict(credit_by_episode(recording))


def credit_by_episode(recording: Recording) -> Iterator[tuple[tuple[str, int], list[AgentTurn]]]:
    """Yield each side and episode with its turns; the messages of one episode alone are kept meanwhile."""
    results = {(result.side, result.episode): result for result in recording.results}
    books: dict[str, tuple[int, CreditBook]] = {}
    for sample in recording:
        message = sample.message if sample.is_of(Observation) or sample.is_of(Report) else None
        if not isinstance(message, Observation | Report):
            continue
        episode, book = books.get(message.side, (-1, CreditBook()))
        if episode != message.episode:
            if episode >= 0:
                yield (message.side, episode), _close(book, results.get((message.side, episode)))
            episode = message.episode
            book = CreditBook()
            books[message.side] = episode, book
        if isinstance(message, Observation):
            book.observe(message)
        else:
            book.report(message)
    for side, (episode, book) in books.items():
        yield (side, episode), _close(book, results.get((side, episode)))


def _close(book: CreditBook, result: Result | None) -> list[AgentTurn]:
    """End an account, and return its turns."""
    if result is not None:
        book.end(result)
    return book.turns


def own_rewards(
    recording: Recording, gamma: float, reward: TurnReward = own_reward
) -> dict[tuple[Seat, int, int], Reward]:
    """Return the reward of each turn, alone and with what came after, by seat, episode and step.

    Args:
        recording: of a match.
        gamma: discount from one turn of an agent to its next, 0 to 1.
        reward: of a turn.
    """
    found = {}
    for (side, episode), turns in credit_by_episode(recording):
        for agent, own in by_agent(turns).items():
            values = [reward(turn) for turn in own]
            for turn, value, to_go in zip(own, values, rewards_to_go(values, gamma), strict=True):
                found[Seat(side, agent), episode, turn.step] = Reward(value, to_go)
    return found


class CreditBook:
    """The running account of one side's episode: give it what the host says, in the order in which it says it.

    Attributes:
        turns: of all agents; the last one of each is still open before `end`.
    """

    def __init__(self) -> None:
        self.turns: list[AgentTurn] = []
        self._open: dict[str, AgentTurn] = {}
        self._answered: dict[str, Observation] = {}
        """By agent, the observation with which its open turn began."""
        self._new: dict[str, Observation] = {}
        """By agent, its observation since the last report."""
        self._orders: dict[str, frozenset[str]] = {}
        """By agent, the accepted calls of its last decision."""
        self._killed = self._lost = 0.0
        """Reported, and not shared out yet."""

    def observe(self, observation: Observation) -> None:
        """Take what an agent sees."""
        if observation.verdict is None:
            self._new[observation.agent] = observation

    def report(self, report: Report) -> None:
        """Take what happened in a step, after the observations of this step."""
        self._share_out(gone={agent for agent, why in report.unasked.items() if why == "no_units"})
        asked = self._new
        self._new = {}
        decided = [agent for agent in report.agents if agent.status in COUNTED]
        for agent in decided:
            self._heed(agent, asked.get(agent.agent))
        for agent in decided:
            self._begin(agent, report, asked)
        for message in report.messages:
            if message.sender in self._open and message.sender not in report.advisers:
                self._open[message.sender].sent += 1
        self._killed += report.killed_value or 0.0
        self._lost += report.lost_value or 0.0

    def end(self, result: Result) -> None:
        """Take the result, after the last report."""
        self._share_out(at_end=True)
        for turn in self._open.values():
            turn.ending = result.outcome

    def _begin(self, agent: AgentReport, report: Report, asked: Mapping[str, Observation]) -> None:
        """Open the turn of a decision."""
        turn = AgentTurn(agent.agent, report.step if agent.asked_step is None else agent.asked_step)
        turn.accepted = len(agent.accepted)
        turn.refused = count_refusals(agent.rejections).total()
        self.turns.append(turn)
        self._open[agent.agent] = turn
        self._orders[agent.agent] = frozenset(agent.accepted)
        if agent.agent in asked:
            self._answered[agent.agent] = asked[agent.agent]

    def _heed(self, agent: AgentReport, seen: Observation | None) -> None:
        """Give the senders of messages credit for the new orders of a reader."""
        new = frozenset(agent.accepted) - self._orders.get(agent.agent, frozenset())
        for message in seen.messages if seen and new else ():
            sender = self._open.get(message.sender)
            if sender and not message.again and sender.heeded < sender.sent and is_acted_on(message.text, new, seen):
                sender.heeded += 1

    def _share_out(self, gone: Collection[str] = (), *, at_end: bool = False) -> None:
        """Share out what was reported before the new observations, as far as these say whose it is.

        Args:
            gone: agents that are not asked because they have no units left.
            at_end: whether to share out all of it.
        """
        held = {agent: _price(_units(seen)) for agent, seen in self._answered.items()} or dict.fromkeys(self._open, 1.0)
        kill_weights = self._kill_weights() or (held if at_end else {})
        loss_weights = self._loss_weights(gone) or (held if at_end else {})
        for agent, share in _shares(self._killed, kill_weights).items():
            self._open[agent].killed += share
        for agent, share in _shares(self._lost, loss_weights).items():
            self._open[agent].lost += share
        self._killed = 0.0 if any(kill_weights.values()) else self._killed
        self._lost = 0.0 if any(loss_weights.values()) else self._lost

    def _kill_weights(self) -> dict[str, float]:
        """Return the price of the enemies that each agent had a part in, by the new observations."""
        fallen = {event.tag: event for seen in self._new.values() for event in _deaths(seen, "enemy")}
        aims = {agent: self._aims(agent, fallen) for agent in self._open}
        weights: dict[str, float] = defaultdict(float)
        for tag, event in fallen.items():
            parts = {agent: aimed[tag] for agent, aimed in aims.items() if aimed[tag]} or {
                agent: 1 for agent, seen in self._new.items() if agent in self._open and _saw_die(seen, tag)
            }
            for agent, share in _shares(_value(event.type), parts).items():
                weights[agent] += share
        return weights

    def _aims(self, agent: str, targets: Collection[str]) -> Counter[str]:
        """Return how many units of an agent had each of some targets; at least one if it ordered so."""
        found: Counter[str] = Counter()
        for unit in _units(self._answered.get(agent)):
            found.update(order.target for order in unit.orders[:1] if order.target and order.target in targets)
        ordered = tags(" ".join(self._orders.get(agent, ())))
        return found | Counter(tag for tag in targets if tag.casefold() in ordered)

    def _loss_weights(self, gone: Collection[str]) -> dict[str, float]:
        """Return the price of the dead of each agent, by the new observations; of one that is gone, all that it had."""
        prices = {
            agent: sum(_value(event.type) for event in _deaths(seen, "own"))
            for agent, seen in self._new.items()
            if agent in self._open
        }
        lost = {agent: _price(_units(self._answered.pop(agent, None))) for agent in gone}
        return {agent: price for agent, price in (prices | lost).items() if price}


def _units(seen: Observation | None) -> Iterator[UnitView]:
    for team in seen.view.teams if seen else ():
        yield from team.units


def _deaths(seen: Observation, alliance: str) -> Iterator[Event]:
    for team in seen.view.teams:
        yield from (event for event in team.events if event.what == "died" and event.alliance == alliance)


def _saw_die(seen: Observation, tag: str) -> bool:
    return any(event.tag == tag for event in _deaths(seen, "enemy"))


def _price(units: Iterator[UnitView]) -> float:
    return sum(_value(unit.type) for unit in units)


def _value(type_: str) -> float:
    """Return the minerals and vespene of a type; 1 for what costs nothing, so that it has a weight."""
    facts = knowledge().get(type_)
    return facts.value or 1.0 if facts else 1.0


def _shares(whole: float, weights: Mapping[str, float]) -> dict[str, float]:
    """Return a number in parts by weight; none if there are no weights."""
    total = sum(weights.values())
    return {name: whole * weight / total for name, weight in weights.items()} if total else {}
