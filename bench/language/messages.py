"""Measure how true the messages of the scripted player are, by what their senders saw and their readers did.

    python -m bench messages                                       SCEB and ECEB, three races, 200 decisions each
    python -m bench messages --tasks simple64_sceb --steps 300 --show 20

A report must say what stands in the observation of its sender. An order must name a place that this observation gives
a reason for, and its reader must carry it out: by its next replies its units are there, on their way, or in a fight.
A message that repeats the last one to the same reader, while that one is in force, is counted as said again. A
message that no rule knows is an error.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NamedTuple

from bench.command_line import make_parser
from bench.matches.ladder import TASKS, Pairing, watch
from khala_agents.scripted.reading import points, read
from khala_agents.scripted.skilled.kinds import fights
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from khala_agents.scripted.reading import Point, Situation, TextTeam
    from khala_protocol.messages import Observation
    from khala_protocol.speech import Speech

GOAL: Final = 98.0
"""Percent of the messages that must be true."""
NEAR: Final = 4.0
"""Cells of the minimap within which units are at a place: a large group stands around it."""
CHANCES: Final = 3
"""Replies of the reader within which it must carry out an order."""
STAYS_S: Final = 60.0
"""How long an order is in force: as long as its reader is shown it."""


class UnknownMessage(Exception):
    """The player says something that no rule judges."""


@dataclass(frozen=True, slots=True)
class Turn:
    """An observation of an agent, and its reply."""

    step: int
    seen: Situation
    reply: Speech


@dataclass(slots=True)
class Transcript:
    """All turns of a game, by agent."""

    turns: dict[str, list[Turn]] = field(default_factory=lambda: defaultdict(list))

    def hear(self, name: str, seen: Observation, text: str) -> None:
        """Keep a turn."""
        self.turns[name].append(Turn(seen.step, read(seen.text), parse(text)))


class Said(NamedTuple):
    """A message with the moment at which it was sent."""

    sender: str
    turn: Turn
    recipient: str
    text: str
    then: Sequence[Turn]
    """The next turns of its reader."""


@dataclass(slots=True)
class Verdict:
    """The messages of a task, and what is wrong with them."""

    said: Counter[str] = field(default_factory=Counter)
    """By the first word of what they say."""
    false: Counter[str] = field(default_factory=Counter)
    """By what is wrong."""
    again: int = 0
    unread: int = 0
    """Orders whose reader was not asked any more: it had lost its units, or the game was over."""
    examples: list[str] = field(default_factory=list)

    @property
    def share(self) -> float:
        """True messages, in percent of those that can be judged."""
        judged = sum(self.said.values()) - self.unread
        return 100.0 * (judged - sum(self.false.values())) / judged if judged else 100.0


def judge(transcript: Transcript) -> Verdict:
    """Judge every message of a game.

    Raises:
        UnknownMessage: no rule knows it.
    """
    verdict = Verdict()
    last: dict[tuple[str, str], tuple[str, float]] = {}
    for said in _messages(transcript):
        pair = (said.sender, said.recipient)
        now = said.turn.seen.time_s
        text, when = last.get(pair, ("", -math.inf))
        verdict.again += text == said.text and now - when < STAYS_S
        last[pair] = said.text, now
        kind, why = fault_of(said)
        verdict.said[kind] += 1
        if why == UNREAD:
            verdict.unread += 1
        elif why:
            verdict.false[f"{kind}: {why}"] += 1
            verdict.examples.append(f"{said.sender} to {said.recipient} at {now:.0f} s: {said.text} {why}")
    return verdict


def _messages(transcript: Transcript) -> Iterator[Said]:
    for sender, turns in transcript.turns.items():
        for turn in turns:
            for message in turn.reply.messages:
                theirs = transcript.turns.get(message.recipient, [])
                then = [later for later in theirs if later.step > turn.step][:CHANCES]
                yield Said(sender, turn, message.recipient, message.text, then)


def fault_of(said: Said) -> tuple[str, str]:
    """Return the kind of a message and what is wrong with it, "" for nothing.

    Raises:
        UnknownMessage: no rule knows it.
    """
    for kind, (pattern, rule) in RULES.items():
        if found := pattern.fullmatch(said.text):
            return kind, rule(said, found)
    raise UnknownMessage(
        f"{said.sender} writes {said.text!r}, and no rule of bench/language/messages.py judges that; add one"
    )


# rules ----------------------------------------------------------------------------------------------------------------

UNREAD: Final = "nobody read it"


def _report(said: Said, found: re.Match[str]) -> str:
    team = said.turn.seen.teams.get(found["team"])
    if team is None or not team.own:
        return "is of a team that it does not have"
    if team.minimap is None or math.dist(team.minimap, points(said.text)[0]) > 0.1:
        return f"is at {team.minimap}"
    return "" if len(team.enemies) == int(found["enemies"]) else f"sees {len(team.enemies)}"


def _gather(said: Said, _: re.Match[str]) -> str:
    return _carried_out(said)


def _defend(said: Said, _: re.Match[str]) -> str:
    (goal,) = points(said.text)
    if all(math.dist(goal, at) > 0.1 for at in said.turn.seen.alarms):
        return "names a place that is not under attack"
    return _carried_out(said)


def _attack(said: Said, _: re.Match[str]) -> str:
    (goal,) = points(said.text)
    own = [place.at for place in said.turn.seen.places if "yours" in place.about]
    if any(math.dist(goal, at) <= NEAR for at in own):
        return "names an own base"
    return _carried_out(said)


def _help(said: Said, found: re.Match[str]) -> str:
    (goal,) = points(said.text)
    heard = [points(text) for sender, text in said.turn.seen.messages if sender == found["name"]]
    return "" if any(goal in named for named in heard) else "asks for help that nobody asked for"


def _carried_out(said: Said) -> str:
    """Return what is wrong if the reader of an order does something else."""
    (goal,) = points(said.text)
    then = [turn for turn in said.then if any(team.own for team in turn.seen.teams.values())]
    if not then:
        return UNREAD
    if any(_overridden(turn, said) for turn in then) or any(_does(turn, goal) for turn in then):
        return ""
    return "is not carried out"


def _overridden(turn: Turn, said: Said) -> bool:
    """Return whether the sender has ordered something else before the reader could act."""
    texts = [text for sender, text in turn.seen.messages if sender == said.sender]
    return bool(texts) and texts[-1] != said.text


def _does(turn: Turn, goal: Point) -> bool:
    """Return whether all fighting teams of an agent obey: each is at a place, goes there, or fights on its way."""
    armed = [team for team in turn.seen.teams.values() if any(fights(unit.type) for unit in team.own)]
    return all(team.enemies or _is_at(team, goal) or _goes(turn, team, goal) for team in armed)


def _is_at(team: TextTeam, goal: Point) -> bool:
    return team.minimap is not None and math.dist(team.minimap, goal) <= NEAR


def _goes(turn: Turn, team: TextTeam, goal: Point) -> bool:
    calls = [call for call in turn.reply.calls if call.team == team.name]
    aims = [arg for call in calls for arg in call.args if not isinstance(arg, str)]
    return any(math.dist(goal, aim) <= NEAR for aim in aims)


_AT: Final = r"\[-?[\d.]+, -?[\d.]+\]"
RULES: Final[dict[str, tuple[re.Pattern[str], Callable[[Said, re.Match[str]], str]]]] = {
    "report": (
        re.compile(rf"(?P<team>\S+) is at {_AT} of the minimap and sees (?P<enemies>\d+) enem(?:y|ies)\."),
        _report,
    ),
    "gather": (re.compile(rf"Gather at {_AT} and defend it\."), _gather),
    "defend": (re.compile(rf"Defend {_AT}\."), _defend),
    "attack": (re.compile(rf"Attack {_AT}\."), _attack),
    "help": (re.compile(rf"Help (?P<name>\S+) at {_AT}\."), _help),
}
"""How each sentence of the player looks, and what is wrong with it, "" for nothing."""


# command line ---------------------------------------------------------------------------------------------------------


def measure(task: str, *, steps: int, seed: int) -> Verdict:
    """Play a part of a game against level 4, and judge what was said."""
    transcript = Transcript()
    watch(Pairing(task, None, "medium_hard", seed, "skilled"), transcript.hear, steps=steps)
    return judge(transcript)


def report(name: str, verdict: Verdict, show: int) -> Iterator[str]:
    """Yield the lines of a task."""
    number, false = sum(verdict.said.values()), sum(verdict.false.values())
    kinds = ", ".join(f"{count} {kind}" for kind, count in verdict.said.most_common())
    yield f"{name:22} {number:5} messages ({kinds or 'none'}): {verdict.share:5.1f} % true, {false} false"
    yield f"    {verdict.again} said again within {STAYS_S:.0f} s, {verdict.unread} orders not read any more"
    yield from (f"    {count:4} {what}" for what, count in verdict.false.most_common())
    yield from (f"    {example}" for example in verdict.examples[:show])


def main() -> int:
    """Play the tasks that the options name; the exit code is 1 if too many messages of any are false."""
    options = make_parser(__doc__)
    options.add_argument("--tasks", nargs="+", default=TASKS, metavar="TASK")
    options.add_argument("--steps", type=int, default=200, help="decisions of each game at most")
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--show", type=int, default=0, help="false messages to print for each task")
    given = options.parse_args()
    found: dict[str, Verdict] = {}
    for name in given.tasks:
        found[name] = measure(name, steps=given.steps, seed=given.seed)
        if not given.json:
            print("\n".join(report(name, found[name], given.show)), flush=True)
    if given.json:
        rows = {
            name: {
                "messages": sum(score.said.values()),
                "true_percent": round(score.share, 1),
                "again": score.again,
                "unread": score.unread,
            }
            for name, score in found.items()
        }
        print(json.dumps(rows))
    return int(any(score.share < GOAL for score in found.values()))
