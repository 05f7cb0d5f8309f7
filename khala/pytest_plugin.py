"""Fixtures for everybody who has Khala installed; pytest loads this module by itself.

    async def test_my_prompt_still_plays_the_same(replay_agents):
        assert await replay_agents("golden.mcap") == []

    async def test_my_rules_still_show_the_same(replay_host):
        assert await replay_host("golden.mcap") == []

They are `khala.testing.replay_agents` and `khala.testing.replay_host`, imported when they are used only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from khala_protocol.recording.difference import Difference


@pytest.fixture
def replay_host() -> Callable[..., Awaitable[list[Difference]]]:
    """Recorded replies through host, bridge and game: what observations are not the recorded ones?"""
    from khala import testing  # noqa: PLC0415  # it imports PySC2

    return testing.replay_host


@pytest.fixture
def replay_agents() -> Callable[..., Awaitable[list[Difference]]]:
    """Recorded observations through workers and prompts: what replies are not the recorded ones?"""
    from khala import testing  # noqa: PLC0415

    return testing.replay_agents
