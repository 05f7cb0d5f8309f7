"""Write down what every agent sees in two whole games: `python -m docs.whole_games`.

ECEB and SCEB of Protoss on the simulator, from a fixed seed, played to their ends by the scripted player `skilled` from
the texts alone. Of each agent ten decisions are kept, evenly spaced over those it was asked for, with their pictures
and replies: docs/reading and docs/images/reading.
"""

from __future__ import annotations

import asyncio
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from docs.played import play
from khala_bridge.task.images import PAPER, ImageSpec
from khala_orchestrator.config import load_task
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from docs.played import Decided, Game
    from khala_bridge.task.config import TaskConfig

DOCS = Path(__file__).parent
OUT, IMAGES = DOCS / "reading", DOCS / "images" / "reading"
MANY = 10
"""Decisions of each agent."""
SIZE_PX = 256


class Told(NamedTuple):
    """A game and what its page says first."""

    task: str
    title: str
    level: str


GAMES = (
    Told("simple64_eceb", "A whole game of two agents", "easy"),
    Told("simple64_sceb", "A whole game of twelve agents", "easy"),
)


def task_of(told: Told) -> TaskConfig:
    """Return the task of a game, with the paper's pictures for each kind of agent."""
    task = load_task(told.task)
    agents = tuple(
        agent.model_copy(
            update={
                "images": tuple(
                    ImageSpec(what=what, format="webp", max_teams=1, size_px=SIZE_PX) for what in PAPER[agent.kind]
                )
            }
        )
        for agent in task.agents
    )
    opponent = task.opponent.model_copy(update={"difficulty": told.level})
    return task.model_copy(update={"agents": agents, "opponent": opponent})


def chosen(decided: Sequence[Decided]) -> list[Decided]:
    """Return ten of an agent's decisions, evenly spaced, the first and the last among them."""
    if len(decided) <= MANY:
        return list(decided)
    return [decided[round(number * (len(decided) - 1) / (MANY - 1))] for number in range(MANY)]


def page(told: Told, game: Game, task: TaskConfig) -> Iterator[str]:
    """Yield the lines of a game's page, and write its pictures."""
    (result,) = game.results
    minutes, seconds = divmod(int(result.game_s), 60)
    yield f"# {told.title}\n"
    yield (
        f"`{told.task}` against the computer ({told.level}), played by `skilled` from these texts alone: "
        f"{result.outcome} after {minutes}:{seconds:02} and {result.steps} decisions. Of each agent ten decisions, "
        "evenly spaced over those for which it was asked: pictures, text, reply. `python -m docs.whole_games` makes "
        "this page.\n"
    )
    for agent in task.agents:
        decided = game.by_agent.get(agent.name, [])
        yield f"## {agent.name}\n"
        yield f"{agent.role.strip()}\n" if decided else f"{agent.role.strip()} It had no units, and was never asked.\n"
        for one in chosen(decided):
            yield from _decision(told, agent.name, one)


def _decision(told: Told, agent: str, one: Decided) -> Iterator[str]:
    seen = one.question.observation
    minutes, seconds = divmod(int(seen.view.time_s), 60)
    yield f"### {agent}, {minutes}:{seconds:02}\n"
    for image, picture in zip(seen.images, one.question.pictures, strict=True):
        name = f"{told.task}-{agent}-{seen.step}-{image.name.replace(':', '-').replace('/', '-')}.webp".lower()
        (IMAGES / name).write_bytes(picture)
        yield f"![{image.title}](../images/reading/{name})\n"
    yield f"```text\n{seen.text.rstrip()}\n```\n"
    yield f"```text\n{one.reply.rstrip()}\n```\n"


def main() -> None:
    """Play both games and write their pages."""
    OUT.mkdir(parents=True, exist_ok=True)
    IMAGES.mkdir(parents=True, exist_ok=True)
    for old in IMAGES.iterdir():
        old.unlink()
    with tempfile.TemporaryDirectory() as directory:
        sc2path = install(Path(directory) / "sc2")
        for told in GAMES:
            task = task_of(told)
            game = asyncio.run(play(task, sc2path, seed=1))
            text = "\n".join(page(told, game, task)).rstrip() + "\n"
            (OUT / f"{told.task}.md").write_text(text, encoding="utf-8")
            sys.stdout.write(f"{told.task}: {game.results[0].outcome}, {len(text) / 1000:.0f} kB of text\n")


if __name__ == "__main__":
    main()
