"""Who decides after the step at which a match is forked."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from typing import TYPE_CHECKING

from khala_protocol.errors import ConfigError
from khala_sc2.playing.minds import Minds, groups_of, minds_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from khala_bridge.task.config import TaskConfig


def players_of(
    task: TaskConfig, common: Minds | None, sides: Mapping[str, str], single: Iterable[str]
) -> dict[str, Minds]:
    """Return by side how its agents decide.

    Args:
        task: of the match.
        common: for agents that nothing else is said of; None if nothing was said.
        sides: by side, what `Minds.named` takes.
        single: the same for single agents, as `NAME=MODEL` or `SIDE/NAME=MODEL`.

    Raises:
        ConfigError: there is no such side or agent, or nothing is said of one, or one cannot decide this way.
    """
    by_side = minds_of([side.side for side in task.per_side()], common or Minds(), sides)
    named = _single_models(task, single)
    if common is None:
        _check_all_are_named(task, sides, named)
    players = {side: replace(minds, agents=named.get(side, {})) for side, minds in by_side.items()}
    for _, minds, _ in groups_of(task, players):
        minds.check(task.clock)
    return players


def _single_models(task: TaskConfig, single: Iterable[str]) -> dict[str, dict[str, str]]:
    """Return the models of single agents, by side and name."""
    seats = [(side.side, agent.name) for side in task.per_side() for agent in side.agents]
    named: dict[str, dict[str, str]] = defaultdict(dict)
    for text in single:
        whom, equals, model = text.partition("=")
        if not (whom and equals and model):
            raise ConfigError(f"{text!r} names no agent with its model: write Commander=openai", source="--agent")
        found = [(side, name) for side, name in seats if whom in (name, f"{side}/{name}")]
        if len(found) != 1:
            there_are = ", ".join(f"{side}/{name}" for side, name in found or seats)
            raise ConfigError(f"{whom!r} is not the name of one agent: there are {there_are}", source="--agent")
        ((side, name),) = found
        named[side][name] = model
    return named


def _check_all_are_named(task: TaskConfig, sides: Mapping[str, str], named: Mapping[str, Mapping[str, str]]) -> None:
    rest = [
        f"{side.side}/{agent.name}"
        for side in task.per_side()
        for agent in side.agents
        if side.side not in sides and agent.name not in named.get(side.side, {})
    ]
    if rest:
        raise ConfigError(
            f"nobody decides for {', '.join(rest)} after the step, where recorded decisions no longer hold: "
            "give --model for all agents, or a model for each side or agent"
        )
