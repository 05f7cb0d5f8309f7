"""What is published before the first step: a briefing for each agent, and the run card for everyone else."""

from __future__ import annotations

import functools
import importlib.metadata
import platform
from typing import TYPE_CHECKING

from khala_bridge.catalogue.catalogue import catalogue_sha256
from khala_bridge.observe.text import knowledge_of
from khala_bridge.observe.text.example import example
from khala_orchestrator.match.provenance import code_sha256, hardware
from khala_protocol.messages import Briefing, Contact, Run

if TYPE_CHECKING:
    from khala_bridge.game.game import GameIdentity
    from khala_bridge.task.config import AgentConfig, TaskConfig
    from khala_orchestrator.config import MatchConfig

_PACKAGES = ("pysc2", "eclipse-zenoh", "pydantic", "protobuf", "numpy")


def briefing(task: TaskConfig, agent: AgentConfig, run: str, episode: int, episodes: int = 1) -> Briefing:
    """Return everything that one agent has to know, except its observations."""
    others = task.correspondents(agent)
    return Briefing(
        run=run,
        agent=agent.name,
        side=task.side,
        episode=episode,
        episodes=episodes,
        role=agent.role,
        agent_kind=agent.kind,
        task="\n".join(text for text in (task.task, agent.task) if text),
        teams=agent.team_specs(),
        knowledge=knowledge_of(agent, task.map_data),
        actions=agent.specs(),
        correspondents=tuple(Contact(name=other.name, role=other.role) for other in others),
        channels=task.channels if others else (),
        frames=task.frames,
        clock=task.clock,
        max_actions=task.max_actions_of(agent),
        memory=task.memory_of(agent),
        standing_orders=task.standing_orders,
        example=example(task, agent),
    )


def run_card(config: MatchConfig, game: GameIdentity) -> Run:
    """Return everything that is needed to repeat the run, or to trust its numbers."""
    task = config.task
    return Run(
        run=config.run,
        task=task.name,
        variant=task.variant,
        map_name=task.map_spec.name,
        map_sha256=game.map_sha256,
        seed=config.seed,
        episodes=config.episodes,
        game=f"{config.game} {game.version}",
        opponent=game.opponent or task.against,
        executor=task.executor,
        clock=task.clock,
        agents=tuple(
            card.but(human=True) if (card.side, card.name) in config.humans else card
            for side in task.per_side()
            for card in side.cards()
        ),
        rethink=config.rethink,
        advisers=tuple(dict.fromkeys(adviser.name for side in task.per_side() for adviser in side.advisers)),
        catalogue_sha256=catalogue_sha256(),
        versions=versions(),
        code_sha256=code_sha256(),
        hardware=hardware(),
        labels=config.labels,
        config=task.model_dump(mode="json"),
        forked=config.forked,
    )


def versions() -> dict[str, str]:
    """Return the versions of what plays, here and now."""
    ours = {"python": platform.python_version(), "khala": _version("khala-sc2")}
    return ours | {name: _version(name) for name in _PACKAGES}


@functools.cache
def _version(name: str) -> str:
    return importlib.metadata.version(name)  # reads a file, 4 ms for each
