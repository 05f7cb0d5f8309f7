"""Read a whole game with a model's eyes: tokens per request by kind of agent and section, requests not made, host time.

    python -m bench.texts                                   SCEB of Protoss, played by `skilled` from the texts
    python -m bench.texts --task simple64_eceb --steps 200
    python -m bench.texts --level hard --show 60            also the texts and replies of decision 60
    python -m bench.texts --json                            one JSON object on stdout

Sides, agents and texts are those of a match; there is no bus and no model. Tokens are Khala's estimate. A request has
the system prompt with its example, which providers keep in a cache, and the observation, which they do not.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import logging
import random
import sys
import tempfile
import time
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from khala.playing.hosting import game_of
from khala_agents.prompt import Prompt
from khala_agents.scripted.players import PLAYERS
from khala_bridge.observe.text import SECTIONS, tokens
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_orchestrator.match.cards import briefing
from khala_orchestrator.match.match import Match, SilentObserver
from khala_orchestrator.match.side import sides_of
from khala_orchestrator.match.turn import Answer, Answers
from khala_orchestrator.roster import Seat
from khala_protocol.messages import Reply
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from khala_orchestrator.match.turn import Question
    from khala_protocol.messages import Report, Result


@dataclass(slots=True)
class Read:
    """The texts of one kind of agent."""

    requests: int = 0
    unasked: int = 0
    prompt: int = 0
    """Tokens of the system prompts with their examples, over all requests."""
    text: int = 0
    """Tokens of the observations."""
    host_s: float = 0.0
    """Time that the host took to make them."""


@dataclass
class Reader(SilentObserver):
    """Agents that answer at once, and what they were given to read."""

    heads: dict[str, int]
    """By agent, tokens of its system prompt and example."""
    kinds: dict[str, str]
    seed: int
    show: int | None
    kind: defaultdict[str, Read] = field(default_factory=lambda: defaultdict(Read))
    results: list[Result] = field(default_factory=list)

    async def ask(self, questions: Iterable[Question], *, wait: bool = True) -> Answers:  # noqa: ARG002
        """Return the answers of one step; questions are made on demand, so the time of each is the host's."""
        found: dict[Seat, Answer] = {}
        began = time.perf_counter()
        for question in questions:
            seen = question.observation
            read = self.kind[self.kinds[seen.agent]]
            read.host_s += time.perf_counter() - began
            read.requests += 1
            read.prompt += self.heads[seen.agent]
            read.text += tokens(seen.text)
            text = PLAYERS["skilled"](seen.text, random.Random(f"{self.seed} {seen.agent} {seen.step}"))
            if seen.step == self.show:
                sys.stdout.write(f"\n===== {seen.agent}\n{seen.text}\n--- reply\n{text}\n")
            place = {"run": seen.run, "agent": seen.agent, "side": seen.side, "episode": 0, "step": seen.step}
            found[Seat(seen.side, seen.agent)] = Answer("ok", Reply.model_validate({**place, "text": text}))
            began = time.perf_counter()
        return Answers(found)

    async def report(self, report: Report) -> None:
        """Count who was not asked."""
        for agent in report.unasked:
            self.kind[self.kinds[agent]].unasked += 1

    async def result(self, result: Result) -> None:
        """Keep the result."""
        self.results.append(result)


class Sections:
    """Time and tokens of each section; every section is wrapped while this is entered."""

    def __init__(self) -> None:
        self.spent_s: defaultdict[str, float] = defaultdict(float)
        self.tokens: Counter[str] = Counter()
        self._before = dict(SECTIONS)

    def __enter__(self) -> Self:
        for name, section in self._before.items():
            object.__setattr__(section, "write", self._timed(name, section.write))
        return self

    def __exit__(self, *_: object) -> None:
        for section in self._before.values():
            object.__setattr__(section, "write", section.write.__wrapped__)  # type: ignore[attr-defined]

    def _timed(self, name: str, write: Any) -> Any:
        def timed(page: Any) -> list[str]:
            began = time.perf_counter()
            lines = list(write(page))
            self.spent_s[name] += time.perf_counter() - began
            self.tokens[name] += tokens("\n".join(lines))
            return lines

        timed.__wrapped__ = write  # type: ignore[attr-defined]
        return timed


def play(options: argparse.Namespace) -> tuple[Reader, Sections]:
    """Play the game that the options describe."""
    task = change(load_task(options.task), max_steps=options.steps)
    opponent = task.opponent.model_copy(update={"difficulty": options.level, "race": options.race})
    task = task.model_copy(update={"opponent": opponent})
    config = MatchConfig(task=task, run="texts", seed=options.seed)
    heads = {agent.name: _head(task, agent) for agent in task.agents}
    reader = Reader(heads, {agent.name: agent.kind for agent in task.agents}, options.seed, options.show)

    async def match(sc2path: Path) -> None:
        async with game_of(config, sc2path) as game:
            async for _ in Match(config, game, sides_of(config), reader, reader).play():
                pass

    with tempfile.TemporaryDirectory() as directory, Sections() as sections:
        asyncio.run(match(install(Path(directory) / "sc2")))
    return reader, sections


def _head(task: Any, agent: Any) -> int:
    told = Prompt(briefing(task, agent, "texts", 0)).messages("")
    return sum(tokens(message.content) for message in told)


def table(reader: Reader, sections: Sections) -> Iterator[str]:
    """Yield the lines of the report."""
    (result,) = reader.results
    yield f"{result.outcome}, {result.cause}, {result.steps} decisions, {result.game_s:.0f} s of game"
    yield ""
    yield "| agents | requests | not asked | prompt, tokens | observation, tokens | host, ms |"
    yield "|---|---:|---:|---:|---:|---:|"
    for kind, read in sorted(reader.kind.items()):
        if not read.requests:
            continue
        means = (read.prompt / read.requests, read.text / read.requests, 1000 * read.host_s / read.requests)
        yield f"| {kind} | {read.requests} | {read.unasked} | {means[0]:.0f} | {means[1]:.0f} | {means[2]:.2f} |"
    total = sum(read.prompt + read.text for read in reader.kind.values())
    yield ""
    yield f"{total / 1e6:.2f} M tokens in all, {total / result.steps:.0f} a decision of the side"
    yield ""
    yield "| section | tokens | share | host, ms a request |"
    yield "|---|---:|---:|---:|"
    text = sum(sections.tokens.values())
    requests = sum(read.requests for read in reader.kind.values())
    for name, count in sections.tokens.most_common():
        if count:
            yield f"| {name} | {count} | {100 * count / text:.0f} % | {1000 * sections.spent_s[name] / requests:.2f} |"


def main() -> None:
    """Play and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--task", default="simple64_sceb")
    parser.add_argument("--steps", type=int, default=None, help="decisions at most; default: as the task says")
    parser.add_argument("--level", default="easy", help="of the computer player")
    parser.add_argument("--race", default="zerg", help="of the computer player")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--show", type=int, help="a decision whose texts to print")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    logging.disable(logging.WARNING)  # PySC2 warns of abilities that it has no names for
    reader, sections = play(options)
    if options.json:
        kinds = {kind: vars_of(read) for kind, read in reader.kind.items()}
        sys.stdout.write(json.dumps({"kinds": kinds, "sections": sections.tokens, "ms": _ms(sections)}) + "\n")
        return
    sys.stdout.write("\n".join(table(reader, sections)) + "\n")


def vars_of(read: Read) -> dict[str, float]:
    """Return the numbers of one kind of agent."""
    return {name: getattr(read, name) for name in Read.__slots__}


def _ms(sections: Sections) -> dict[str, float]:
    return {name: round(1000 * spent_s, 1) for name, spent_s in sections.spent_s.items()}


if __name__ == "__main__":
    main()
