"""Fixtures for every project that has Khala installed; pytest loads this module by itself.

    async def test_my_prompt_still_plays_the_same(replay_agents):
        assert await replay_agents("golden.mcap") == []

    async def test_my_rules_still_show_the_same(replay_host):
        assert await replay_host("golden.mcap") == []

They are `khala_sc2.testing.replay_agents` and `khala_sc2.testing.replay_host`, imported only when used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from khala_protocol.recording.difference import Difference


@pytest.fixture
def replay_host() -> Callable[..., Awaitable[list[Difference]]]:
    """Replay recorded replies through host, bridge and game, and return the observations that differ."""
    from khala_sc2 import testing  # noqa: PLC0415  # it imports PySC2

    return testing.replay_host


@pytest.fixture
def replay_agents() -> Callable[..., Awaitable[list[Difference]]]:
    """Replay recorded observations through workers and prompts, and return the replies that differ."""
    from khala_sc2 import testing  # noqa: PLC0415

    return testing.replay_agents
