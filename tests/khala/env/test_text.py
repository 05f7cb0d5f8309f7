"""The environment in words: what agents read, what their replies do, and what that is worth."""

from __future__ import annotations

import gc
import pickle
import random
import warnings
from typing import TYPE_CHECKING, Any

import cloudpickle  # type: ignore[import-untyped]  # it has no types
import numpy as np
import psutil
import pytest

from khala_agents.scripted.players import PLAYERS
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_protocol.errors import ConfigError
from khala_protocol.messages import Casualties, Observation, Report, Result
from khala_protocol.recording import Recording
from khala_sc2 import env as words
from khala_sc2.env.rewards import battle
from khala_sc2.playing import one_process
from khala_sc2.playing.minds import Minds

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # its tests import environments of its own, which warn
    from pettingzoo.test import max_cycles_test, parallel_api_test, parallel_seed_test

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from khala_sc2.env.text import TextParallelEnv

game = pytest.mark.game


@pytest.fixture
def pair() -> Iterator[TextParallelEnv]:
    env = words.parallel_env("2s3z_pair", max_cycles=6, render_mode="rgb_array")
    yield env
    env.close()


@game
async def test_agents_read_and_write_what_they_do_over_the_bus(pair: TextParallelEnv, tmp_path: Path) -> None:
    config = MatchConfig(
        task=change(load_task("2s3z_pair"), max_steps=6), run="words", seed=3, record=tmp_path / "words.mcap"
    )
    (result,) = await one_process.play(config, {"blue": Minds().with_name("skilled")}, game="simulator")
    recorded = [one.text for one in Recording.open(tmp_path / "words.mcap").of(Observation)]

    skilled, read, worth = PLAYERS["skilled"], list[str](), 0.0
    terminated, truncated = dict[str, bool](), dict[str, bool]()
    seen, infos = pair.reset(seed=3)
    while pair.agents:
        assert [seen[agent] for agent in pair.agents] == [infos[agent]["observation"].text for agent in pair.agents]
        read += seen.values()
        replies = {agent: skilled(text, random.Random(f"0 {text}")) for agent, text in seen.items()}
        seen, rewards, terminated, truncated, infos = pair.step(replies)
        worth += rewards["Zealots"]
    assert read == recorded
    assert (set(terminated.values()), set(truncated.values())) == ({False}, {True})
    assert infos["Zealots"]["result"].killed == result.killed
    assert worth == pytest.approx((result.killed.value - result.lost.value) / 1000)
    assert infos["Zealots"]["reports"][0].fate == "fresh"


@pytest.mark.parametrize("make", [words.parallel_env, words.env], ids=["parallel", "aec"])
@pytest.mark.parametrize("library", [pickle, cloudpickle], ids=["pickle", "cloudpickle"])
def test_an_environment_is_pickled_before_its_first_episode(make: Any, library: Any) -> None:
    env = make("2s3z_pair", agents=["Zealots"], others="skilled", max_cycles=3)
    again = library.loads(library.dumps(env))
    assert again.possible_agents == ["Zealots"]
    assert vars(again.unwrapped)["_task"] == vars(env.unwrapped)["_task"]


@pytest.mark.slow
@game
def test_an_environment_with_an_episode_says_why_it_is_not_pickled(pair: TextParallelEnv) -> None:
    pair.reset(seed=1)
    with pytest.raises(TypeError, match=r"cannot be pickled or copied between reset\(\) and close\(\)"):
        pickle.dumps(pair)
    pair.close()
    again = pickle.loads(pickle.dumps(pair))
    assert again.agents == []


@game
def test_an_episode_follows_in_the_same_match_and_a_picture_shows_it(pair: TextParallelEnv) -> None:
    with pytest.raises(RuntimeError, match="no episode has begun"):
        pair.render()
    seen, _ = pair.reset(seed=1)
    assert all(pair.observation_space(agent).contains(text) for agent, text in seen.items())
    first = pair.render()
    while pair.agents:
        pair.step(dict.fromkeys(pair.agents, ""))
    last = pair.render()
    assert first is not None
    assert last is not None
    assert first.shape == (512, 512, 3)
    assert not np.array_equal(first, last)
    assert pair.step({}) == ({}, {}, {}, {}, {})
    _, infos = pair.reset()
    assert {info["observation"].episode for info in infos.values()} == {1}


@pytest.mark.slow
@game
def test_new_matches_share_a_process_and_are_those_of_new_processes() -> None:
    env, read = words.parallel_env("2s3z", max_cycles=20), list[list[str]]()  # until the fight draws its first lots
    before, used = set(psutil.Process().children()), set()
    for seed in (1, 2, 1):
        seen, _ = env.reset(seed=seed)
        read.append(list(seen.values()))
        while env.agents:
            seen, *_ = env.step({agent: PLAYERS["skilled"](text, random.Random(0)) for agent, text in seen.items()})
            read[-1] += seen.values()
        used |= set(psutil.Process().children()) - before
    env.close()
    assert read[0] == read[2] != read[1]
    assert len(used) == 1
    assert not any(process.is_running() for process in used)


@game
def test_an_environment_that_is_dropped_ends_its_match_and_its_game() -> None:
    env = words.parallel_env("2s3z", max_cycles=3)
    before = set(psutil.Process().children())
    env.reset(seed=1)
    (process,) = set(psutil.Process().children()) - before
    del env
    gc.collect()  # what is left of it would be an unraisable error now
    process.wait(10)


@pytest.mark.slow
@game
def test_one_side_is_played_against_another_that_a_script_plays() -> None:
    env = words.parallel_env("duel_3m", agents=["red/Captain"], others="focus-fire", max_cycles=2)
    _, infos = env.reset(seed=1)
    assert list(infos) == ["red/Captain"]
    assert infos["red/Captain"]["briefing"].side == "red"
    env.step({"red/Captain": ""})
    *_, infos = env.step({"red/Captain": ""})
    assert infos["red/Captain"]["result"].episode == 0
    env.close()


@pytest.mark.slow
@game
def test_text_env_passes_the_parallel_api_test() -> None:
    env = words.parallel_env(max_cycles=3)
    parallel_api_test(env, num_cycles=10)
    env.close()


@pytest.mark.slow
@game
def test_text_env_passes_the_parallel_seed_test() -> None:
    parallel_seed_test(lambda: words.parallel_env(max_cycles=5), num_cycles=5)


@pytest.mark.slow
@game
def test_text_envs_pass_the_max_cycles_test() -> None:
    max_cycles_test(words)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"agents": ["Nobody"]}, "the task 2s3z_pair has no agent 'Nobody': it has Stalkers, Zealots"),
        ({"max_cycles": 0}, "max_steps: "),
        ({"others": "nobody", "agents": ["Zealots"]}, "nobody"),
    ],
)
def test_what_cannot_be_played_is_said(options: dict[str, object], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        words.parallel_env("2s3z_pair", **options).reset()  # type: ignore[arg-type]  # wrong on purpose


def test_a_battle_is_worth_what_it_destroyed_lost_and_won() -> None:
    reports = [
        Report(run="r", episode=0, step=step, game_loop=1, agents=(), killed_value=200.0, lost_value=50.0)
        for step in range(2)
    ]
    none = Casualties()
    result = Result(
        run="r", episode=0, outcome="loss", cause="defeated", steps=2, game_loop=1, game_s=1, wall_s=1, killed=none,
        lost=none, kd=None,
    )  # fmt: skip
    assert battle(reports, None) == pytest.approx(0.3)
    assert battle(reports, result) == pytest.approx(-0.7)
