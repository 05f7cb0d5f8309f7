"""Write down what one agent of each kind sees at a moment of a game: `python -m docs.seen`.

Two games on the simulator from a fixed seed, played by the scripted player `skilled` from the texts alone; at a chosen
decision the observations are kept as they go over the bus. Pictures go to docs/images/seen, and they and the texts to
docs/design/four-observations.md.
"""

from __future__ import annotations

import asyncio
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from docs.played import play
from khala_agents.llm.vision import ANTHROPIC, OPENAI
from khala_bridge.task.images import PAPER, ImageSpec
from khala_orchestrator.config import load_task
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from khala_bridge.task.config import TaskConfig
    from khala_orchestrator.match.turn import Question
    from khala_protocol.messages import ImageRef

DOCS = Path(__file__).parent
OUT = DOCS / "images" / "seen"
PAGE = DOCS / "design" / "four-observations.md"
PREFACE = """# Four observations, with their pictures

This page shows the observation of one agent of each kind, word for word, with the pictures that the paper gives to the
kind. `python -m docs.seen` makes it from two games on the simulator, which the scripted player `skilled` plays from
these texts alone. [What an agent sees](observation.md) explains the texts, and [images](../how-to/images.md) the
pictures. Sizes are those of the bytes on the bus. Token counts are estimates for Anthropic's and OpenAI's models.
"""


@dataclass(frozen=True)
class Scene:
    """One observation, with its agent."""

    game: str
    agent: str
    title: str
    about: str


GAMES = {"pvz_task6_level1": 20, "simple64_eceb": 130}
"""Task → the decision at which its agents are looked at."""
SCENES = {
    "combat_group": Scene(
        "pvz_task6_level1",
        "CombatGroup6",
        "CombatGroup",
        "Four Sentries at the ramp of their base. Force fields have cut a swarm in two, and storms fall on its wings.",
    ),
    "commander": Scene(
        "simple64_eceb",
        "Commander",
        "Commander",
        "A full game after four minutes. The Commander gives orders to the army as a whole.",
    ),
    "developer": Scene(
        "simple64_eceb",
        "Developer",
        "Developer",
        "The same moment. The Developer trains, researches and builds; the host chooses producers and places.",
    ),
    "builder": Scene(
        "simple64_eceb",
        "Builder",
        "Builder",
        "The same moment. The Builder of `simple64_ecsb` has one Probe that places structures at chosen points.",
    ),
}
"""By kind of agent."""


def task_of(game: str) -> TaskConfig:
    """Return the task of a game, with the pictures of its scenes; a Builder joins the one that has none."""
    task = load_task(game)
    agents = {agent.name: agent for agent in task.agents}
    for kind, scene in SCENES.items():
        if scene.game == game:
            agent = agents.get(scene.agent) or load_task("simple64_ecsb").agent(scene.agent)
            images = tuple(ImageSpec(what=what, format="webp", max_teams=1) for what in PAPER[kind])
            agents[agent.name] = agent.model_copy(update={"images": images})
    return task.model_copy(update={"agents": tuple(agents.values())})


def page(questions: Mapping[str, Question]) -> Iterator[str]:
    """Yield the page of the agents' questions, by scene, line by line."""
    yield PREFACE
    for kind, scene in SCENES.items():
        seen = questions[kind].observation
        yield f"## {scene.title}\n"
        yield f"{scene.about} Agent `{scene.agent}` of `{scene.game}`, decision {GAMES[scene.game]}.\n"
        for place, image in enumerate(seen.images, 1):
            yield f"> {image.title} ({_size(image)})\n"
            yield f"![{scene.title}, picture {place}](../images/seen/{kind}-{place}.webp)\n"
        yield f"```text\n{seen.text.rstrip()}\n```\n"


def _size(image: ImageRef) -> str:
    tokens = f"{ANTHROPIC.tokens(image.width, image.height)} or {OPENAI.tokens(image.width, image.height)} tokens"
    return f"{image.width} x {image.height}, {image.bytes / 1000:.0f} kB, {tokens}"


def main() -> None:
    """Play both games and write the page with its pictures."""
    questions: dict[str, Question] = {}
    with tempfile.TemporaryDirectory() as directory:
        sc2path = install(Path(directory) / "sc2")
        for game, step in GAMES.items():
            asked = asyncio.run(play(task_of(game), sc2path, last=step)).by_agent
            questions |= {kind: asked[scene.agent][-1].question for kind, scene in SCENES.items() if scene.game == game}
    OUT.mkdir(parents=True, exist_ok=True)
    for old in OUT.iterdir():
        old.unlink()
    for kind, question in questions.items():
        for place, picture in enumerate(question.pictures, 1):
            (OUT / f"{kind}-{place}.webp").write_bytes(picture)
        size = len(question.observation.text) / 1000
        sys.stdout.write(f"{kind}: {size:.1f} kB of text, {len(question.pictures)} picture(s)\n")
    PAGE.write_text("\n".join(page(questions)).rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
