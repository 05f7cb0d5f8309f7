"""Measure how many calls are refused that are drawn at random among those a text calls valid.

    python -m bench offers                                   the full games, 150 decisions of each, three races
    python -m bench offers --task simple64_ecsb --seeds 1 2  one task, two games
    python -m bench offers --after 220                       the same, after `skilled` has built for 220 decisions
    python -m bench offers --judged                          every offer, along a game of the player `skilled`

First `random-legal` plays, from the text alone as a model does: what the host or the game refuses of its calls is
counted by action and reason. A random player has little after the first minute, so with `--after` it takes over a
side that has an army, and with `--judged` another one plays, and each call that a text offers is judged on the same
snapshot, with arguments drawn at random, and not carried out.
"""

from __future__ import annotations

import json
import logging
import random
import re
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from bench.command_line import make_parser
from khala_agents.scripted.players import PLAYERS, random_calls
from khala_agents.scripted.reading import read
from khala_bridge.act import Actor, executor_of
from khala_bridge.game.game import GameConfig
from khala_bridge.game.pysc2_game import PySC2Game
from khala_bridge.observe import Feedback, Observer
from khala_orchestrator.config import all_tasks, load_task
from khala_protocol.speech import parse
from khala_sc2.playing import games

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from khala_bridge.observe import SideObservation
    from khala_bridge.task.config import TaskConfig
    from khala_protocol.messages import Rejection
    from khala_protocol.speech import Speech

TASKS: Final = tuple(
    sorted(t.name for t in all_tasks() if re.fullmatch("simple64_((terran|zerg)(_.*)?|(eceb|ecsb|sceb).*)", t.name))
)
"""The full games: three races, easy and standard control, easy and standard build."""
STEPS: Final = 150
_FIGURES: Final = re.compile(r"0x[0-9a-f]+|-?\d+(?:\.\d+)?")


@dataclass(slots=True)
class Tally:
    """The calls of a task's random choices, and what became of them."""

    calls: int = 0
    refused: Counter[tuple[str, str, str]] = field(default_factory=Counter)
    """By the kind of the agent, the action and the reason, with `#` for figures."""
    overtaken: int = 0
    """Those that are accepted alone: another agent spent or took what they need in the same turn."""

    @property
    def share(self) -> float:
        """Share of the calls that were refused, in percent."""
        return 100 * sum(self.refused.values()) / self.calls if self.calls else 0.0

    @property
    def dishonest(self) -> float:
        """Share of the calls that were refused for what the text could have known, in percent."""
        return 100 * (sum(self.refused.values()) - self.overtaken) / self.calls if self.calls else 0.0

    def add(self, kind: str, rejection: Rejection) -> None:
        """Count a refusal."""
        action = rejection.text.strip("<>").partition("(")[0]
        self.refused[kind, action, _FIGURES.sub("#", f"{rejection.reason}: {rejection.message}")] += 1


class Table:
    """One game: its side, observed and acted for as a host does."""

    def __init__(self, task: TaskConfig, sc2path: Path, seed: int) -> None:
        """Start the game of a task."""
        config = GameConfig(sc2path=sc2path, map=task.map_spec, opponent=task.opponent, seed=seed)
        self.task = task
        self._game = PySC2Game(config)
        self._observer = Observer(task)
        self._actor = Actor(task)
        self._executor = executor_of(task)
        self._feedback: Mapping[str, Feedback] = {}

    def play(self, steps: int, seed: int, tally: Tally, *, after: int = 0, judged: bool = False) -> None:
        """Play so many decisions, and count either what is refused of them, or of everything that is offered."""
        (snapshot,) = self._game.reset()
        for step in range(after + steps):
            if snapshot.ended:
                return
            counted = step >= after
            seen = self._observer.observe(snapshot, self._feedback)
            texts = {name: agent.text for name, agent in seen.agents.items() if agent.teams}
            if judged and counted:
                self._judge(seen, texts, seed, tally)
            play = PLAYERS["skilled" if judged or not counted else "random-legal"]
            words = {name: parse(play(text, random.Random(f"{seed} {name} {text}"))) for name, text in texts.items()}
            joint = self._actor.joint(seen, words)
            (result,) = self._game.act([self._executor.plan(joint.commands, snapshot, self.task.clock.step_loops)])
            refused = [(refusal.agent, refusal.rejection) for refusal in result.played.refusals]
            refused += [(name, rejection) for name, found in joint.rejections.items() for rejection in found]
            if counted and not judged:
                self._count(words, refused, tally)
                tally.overtaken += sum(self._is_overtaken(seen, name, rejection) for name, rejection in refused)
            self._feedback = {
                name: Feedback(
                    joint.accepted.get(name, ()), tuple(rejection for who, rejection in refused if who == name)
                )
                for name in texts
            }
            snapshot = result.snapshot

    def _judge(self, seen: SideObservation, texts: Mapping[str, str], seed: int, tally: Tally) -> None:
        """Judge every offer by itself, as the only call of the turn."""
        for name, text in texts.items():
            for call in random_calls(read(text), random.Random(f"{seed} {name} {text}")):
                words = {name: parse(call)}
                found = self._actor.joint(seen, words).rejections.get(name, ())
                self._count(words, [(name, rejection) for rejection in found], tally)

    def _is_overtaken(self, seen: SideObservation, name: str, refused: Rejection) -> bool:
        if refused.reason != "not_available":
            return False
        alone = parse(f"Actions:\n    Team {refused.team}:\n        {refused.text}")
        return bool(self._actor.joint(seen, {name: alone}).accepted.get(name))

    def _count(self, words: Mapping[str, Speech], refused: list[tuple[str, Rejection]], tally: Tally) -> None:
        tally.calls += sum(len(speech.calls) for speech in words.values())
        for name, rejection in refused:
            tally.add(self.task.agent(name).kind, rejection)

    def close(self) -> None:
        """End the game."""
        self._game.close()


def measure(name: str, *, steps: int, seeds: list[int], after: int = 0, judged: bool = False) -> Tally:
    """Return the tally of a task over some games."""
    sc2path, _ = games.find("simulator")
    tally = Tally()
    for seed in seeds:
        table = Table(load_task(name), sc2path, seed)
        try:
            table.play(steps, seed, tally, after=after, judged=judged)
        finally:
            table.close()
    return tally


def report(name: str, tally: Tally, most: int) -> Iterator[str]:
    """Yield the lines of a task: its share, and the most frequent refusals."""
    refused = sum(tally.refused.values())
    apart = f", {tally.overtaken} of them overtaken by another agent" if tally.overtaken else ""
    shares = f"{tally.share:5.1f} %, {tally.dishonest:.1f} % dishonest"
    yield f"{name:22} {tally.calls:6} calls {refused:5} refused {shares}{apart}"
    for (kind, action, reason), count in tally.refused.most_common(most):
        yield f"    {count:4} {kind:12} {action:28} {reason[:170]}"


def main() -> int:
    """Play the tasks that the options name; the exit code is 1 if any offers more than 2 % in vain."""
    options = make_parser(__doc__)
    options.add_argument("--task", nargs="+", default=list(TASKS), metavar="TASK", help="names of tasks")
    options.add_argument("--steps", type=int, default=STEPS, help="decisions of each game")
    options.add_argument("--seeds", type=int, nargs="+", default=[1], help="a game for each")
    options.add_argument("--after", type=int, default=0, help="decisions of `skilled` before those that count")
    options.add_argument("--judged", action="store_true", help="judge every offer along a game of `skilled`")
    options.add_argument("--most", type=int, default=12, help="kinds of refusals to print for each task")
    given = options.parse_args()
    logging.getLogger("absl").setLevel(logging.ERROR)  # PySC2 warns of every ability that is newer than itself
    found: dict[str, Tally] = {}
    for name in given.task:
        found[name] = measure(name, steps=given.steps, seeds=given.seeds, after=given.after, judged=given.judged)
        if not given.json:
            print("\n".join(report(name, found[name], given.most)), flush=True)
    if given.json:
        rows = {
            name: {
                "calls": tally.calls,
                "refused": sum(tally.refused.values()),
                "percent": round(tally.share, 2),
                "overtaken": tally.overtaken,
                "dishonest_percent": round(tally.dishonest, 2),
            }
            for name, tally in found.items()
        }
        print(json.dumps(rows))
    return 1 if any(tally.dishonest > 2 for tally in found.values()) else 0
