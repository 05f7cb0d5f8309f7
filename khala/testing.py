"""Replays for tests: a recording in place of the agents, or of the game; `khala.pytest_plugin` has them as fixtures.

    differences = await replay_host("golden.mcap")      recorded replies → host, bridge and game
    differences = await replay_agents("golden.mcap")    recorded observations → workers and prompts

Both return what was sent otherwise than recorded: nothing, if nothing changed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from agents.replay import replay_agent
from khala import games
from khala.local import one_side
from orchestrator.replay import recorded_config, replay
from protocol.recording import Recording

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from agents.policy import Policy
    from protocol.recording.difference import Difference

__all__ = ["replay_agents", "replay_host"]


async def replay_host(path: Path | str, *, game: str = "simulator") -> list[Difference]:
    """Plays a recording again with its replies: the host must publish the recorded observations, byte for byte.

    Args:
        path: a recording.
        game: `simulator`, `starcraft2`, or a directory; only the simulator is expected to repeat itself.
    """
    recording = Recording.open(path)
    sc2path, _ = games.find(game)
    async with one_side(recorded_config(recording), sc2path) as side:
        return await replay(recording, side)


async def replay_agents(path: Path | str, policies: Mapping[str, Policy] | None = None) -> list[Difference]:
    """Shows every agent its recorded observations: each must send the recorded replies and messages.

    Args:
        path: a recording.
        policies: by agent; the others decide with their recorded completions.
    """
    recording = Recording.open(path)
    agents = [card.name for card in recording.run.agents] if recording.run else []
    given = policies or {}
    return [difference for name in agents for difference in await replay_agent(recording, name, given.get(name))]
