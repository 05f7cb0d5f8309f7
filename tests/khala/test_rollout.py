"""A rollout for trainers: prompts as Khala's agents get them, and the credit of each agent."""

from __future__ import annotations

from dataclasses import asdict, replace

import pytest

from khala_protocol.errors import ConfigError, KhalaError
from khala_sc2.dataset.credit import by_agent
from khala_sc2.rollout import RolloutSpec, TeamRollout

SHORT = RolloutSpec("2s3z_pair", seed=2, max_steps=2)


@pytest.mark.game
async def test_a_team_is_asked_with_whole_prompts_until_its_episode_is_over() -> None:
    async with TeamRollout(SHORT) as rollout:
        prompts = await rollout.begin()
        assert list(prompts) == rollout.agents == ["Stalkers", "Zealots"]
        for prompt in prompts.values():
            roles = [message.role for message in prompt.messages]
            assert (roles, prompt.stable) == (["system", "user", "assistant", "user"], 3)
        with pytest.raises(KhalaError, match=r"Nobody is not asked now, Stalkers, Zealots is"):
            await rollout.reply({"Nobody": ""})
        seen = []
        while prompts:
            seen.append({prompt.step for prompt in prompts.values()})
            prompts = await rollout.reply({"Stalkers": "Actions:\nTeam Stalkers-1:\n<Nonsense()>\n"})
    assert seen == [{0}, {1}]
    assert rollout.result is not None
    turns = by_agent(rollout.turns)
    assert [turn.refused for turn in turns["Stalkers"]] == [1, 1]
    assert [turn.ending for turn in turns["Stalkers"]] == [None, "cut"]


@pytest.mark.game
async def test_others_play_the_agents_that_the_caller_does_not() -> None:
    async with TeamRollout(replace(SHORT, agents=["Zealots"])) as rollout:
        prompts = await rollout.begin()
        while prompts:
            assert list(prompts) == ["Zealots"]
            prompts = await rollout.reply({})
    assert {turn.agent for turn in rollout.turns} <= {"Zealots"}


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"task": "../secret.yaml"}, "is not the name of a task"),
        ({"others": "my_module:decide"}, "is none of"),
        ({"agents": ["Nobody"]}, "there is no Nobody"),
        ({"task": "duel_3m", "agents": ["blue/Captain", "red/Captain"]}, "of two sides"),
    ],
)
def test_a_spec_names_no_file_no_code_and_one_side(changes: dict[str, str], sentence: str) -> None:
    with pytest.raises(ConfigError, match=sentence):
        TeamRollout(RolloutSpec(**asdict(SHORT) | changes))
