"""Replays for tests: a recording in place of the agents, or of the game; `khala_sc2.pytest_plugin` has them as fixtures.

    differences = await replay_host("golden.mcap")      recorded replies → host, bridge and game
    differences = await replay_agents("golden.mcap")    recorded observations → workers and prompts

Both return what differs from the recording: nothing, if nothing changed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_agents.policy import as_policy
from khala_agents.replay import replay_agent
from khala_orchestrator.past.replay import recorded_config, replay
from khala_protocol.recording import Recording
from khala_sc2.playing import games
from khala_sc2.playing.hosting import game_of

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping
    from pathlib import Path

    from khala_protocol.recording.difference import Difference

__all__ = ["replay_agents", "replay_host"]


async def replay_host(path: Path | str, *, game: str = "simulator", modules: Collection[str] = ()) -> list[Difference]:
    """Play a recording again with its replies: the host must publish the recorded observations, byte for byte.

    Args:
        path: a recording.
        game: `simulator`, `starcraft2`, or a directory; only the simulator is expected to repeat itself.
        modules: Python modules of sections that the recording may name; it imports no others.
    """
    recording = Recording.open(path)
    sc2path, _ = games.find(game)
    async with game_of(recorded_config(recording, modules=modules), sc2path) as side:
        return await replay(recording, side, modules=modules)


async def replay_agents(path: Path | str, policies: Mapping[str, object] | None = None) -> list[Difference]:
    """Show every agent its recorded observations: each must send the recorded replies.

    Args:
        path: a recording.
        policies: by agent (`red/Captain`, if both sides have one of this name), a policy or what
            `khala_agents.policy.as_policy` accepts; other agents decide with their recorded completions.
    """
    recording = Recording.open(path)
    cards = recording.run.agents if recording.run else ()
    given = {name: as_policy(policy) for name, policy in (policies or {}).items()}
    agents = [(f"{card.side}/{card.name}", card.name) for card in cards]
    return [
        difference
        for whole, name in agents
        for difference in await replay_agent(recording, whole, given.get(whole) or given.get(name))
    ]
