"""Measure the lengths of prompts, what of them a cache keeps, and whether `skilled` wins by them.

    python -m bench prompts                                  battles, tasks of the paper, full games
    python -m bench prompts --tasks smac_10m_vs_11m --seeds 1 2 3
    python -m bench prompts --tasks simple64_eceb --steps 40 --sections

A player plays each task from its texts alone. A prompt is all that a model would be sent; its tokens are its characters
divided by four. *Kept* is the share of a prompt that begins as the one before it did, word for word: a provider's cache
has it. The rows `crowd` are pages of a battle that is made up, with so many units on each side.
"""

from __future__ import annotations

import asyncio
import json
import os
import tempfile
from collections import Counter, defaultdict
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Final

from bench.command_line import make_parser
from bench.tables import print_table
from bench.turns.observe import snapshot
from khala_agents.prompt import Prompt
from khala_agents.scripted.players import PLAYERS
from khala_bridge.observe import Observer
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_orchestrator.match.cards import briefing
from khala_protocol.messages import Briefing, Observation
from khala_protocol.recording import Recording
from khala_sc2.dataset.prompts import Prompter
from khala_sc2.playing.minds import Minds
from khala_sc2.playing.one_process import play

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_protocol.messages import ChatMessage

TASKS: Final = (
    *("2s3z_pair", "2s3z", "3s5z", "smac_27m_vs_30m", "pvz_task1_level1", "pvz_task4_level1", "pvz_task5_level1"),
    "simple64_eceb",
)
CROWDS: Final = (10, 30, 100)
CHARACTERS_PER_TOKEN: Final = 4
MAX_WAIT_S: Final = 600


@dataclass
class Figures:
    """The prompts of one agent of a task, over all its episodes."""

    task: str
    agent: str
    tokens: list[int] = field(default_factory=list)
    kept: list[float] = field(default_factory=list)
    """Shares of prompts, except the first of each episode."""
    sections: Counter[str] = field(default_factory=Counter)
    """Tokens by section of the observation, over all prompts."""
    head: int = 0
    """Tokens of the messages that are the same in all prompts."""


def tokens(text: str) -> int:
    """Return the tokens of a text."""
    return -(-len(text) // CHARACTERS_PER_TOKEN)


def written(messages: Sequence[ChatMessage]) -> str:
    """Return a prompt as one text."""
    return "\n".join(f"{message.role}: {message.content}" for message in messages)


def measure(name: str, seeds: Sequence[int], steps: int | None, player: str) -> tuple[list[Figures], int]:
    """Return the prompts of a task's agents, and how many episodes were won."""
    found: dict[str, Figures] = {}
    won = 0
    for seed in seeds:
        with tempfile.TemporaryDirectory() as directory:
            task = change(load_task(name), max_wait_s=MAX_WAIT_S, max_steps=steps)
            path = Path(directory) / "recording.mcap"
            config = MatchConfig(task=task, run="prompts", record=path, seed=seed)
            results = asyncio.run(play(config, {task.side: Minds(policy=player)}, game="simulator"))
            won += sum(result.outcome == "win" for result in results)
            _read(Recording.open(path), name, found)
    return list(found.values()), won


def _read(recording: Recording, task: str, found: dict[str, Figures]) -> None:
    briefings = {told.agent: told for told in recording.of(Briefing)}
    prompters: dict[str, Prompter] = defaultdict(Prompter)
    before: dict[str, str] = {}
    for seen in recording.of(Observation):
        told = briefings[seen.agent]
        text = written(prompters[seen.agent].messages(told, seen))
        figures = found.setdefault(seen.agent, Figures(task, seen.agent))
        figures.tokens.append(tokens(text))
        figures.head = tokens(written(Prompt(told).messages("")[:-1]))
        if last := before.get(seen.agent):
            figures.kept.append(len(os.path.commonprefix((text, last))) / len(text))  # noqa: RUF071  # of characters
        before[seen.agent] = text
        for section in seen.text.split("\n\n"):
            figures.sections[section.partition("\n")[0].split(" ")[0]] += tokens(section)


def crowd(size: int) -> Figures:
    """Return the prompt of an agent who leads half of an army against one of the same size."""
    task = load_task("2s3z")
    half = size // 2
    army = {"Stalker": half, "Zealot": size - half}
    seen = Observer(task).observe(snapshot(army, army, 16), {})
    agent = task.agents[0]
    messages = Prompt(briefing(task, agent, "prompts", 0)).messages(seen.agents[agent.name].text)
    return Figures(f"crowd of {size}", agent.name, [tokens(written(messages))], head=tokens(written(messages[:-1])))


def main() -> None:
    """Play, and print a table or a list in JSON."""
    parser = make_parser(__doc__)
    parser.add_argument("--tasks", nargs="*", default=TASKS, metavar="TASK", help="names of tasks")
    parser.add_argument("--seeds", nargs="+", type=int, default=[1], help="an episode for each")
    parser.add_argument("--steps", type=int, help="decisions of each episode at most; default: the task's")
    parser.add_argument("--player", default="skilled", choices=list(PLAYERS), help="who plays")
    parser.add_argument("--sections", action="store_true", help="say what each section of the observations takes")
    parser.add_argument("--crowds", nargs="*", type=int, default=CROWDS, help="units on each side of made-up battles")
    given = parser.parse_args()
    rows, agents = [], []
    for name in given.tasks:
        found, won = measure(name, given.seeds, given.steps, given.player)
        agents += found
        rows += [_row(each, f"{won} of {len(given.seeds)}") for each in found]
    crowds = [crowd(size) for size in given.crowds]
    rows += [_row(each, "") for each in crowds]
    if given.json:
        print(json.dumps([asdict(each) for each in (*agents, *crowds)]))
        return
    print_table(("task", "agent", "prompts", "head", "median", "most", "kept", "won"), rows, left=("agent",))
    for each in agents if given.sections else ():
        count = len(each.tokens)
        parts = ", ".join(f"{name} {total / count:.0f}" for name, total in each.sections.most_common())
        print(f"{each.task} {each.agent}: {parts}")


def _row(each: Figures, won: str) -> tuple[object, ...]:
    kept = f"{median(each.kept):.0%}" if each.kept else ""
    return each.task, each.agent, len(each.tokens), each.head, round(median(each.tokens)), max(each.tokens), kept, won
