"""Clients of OpenEnv play agents of matches: over a websocket, over HTTP, several at a time."""

from __future__ import annotations

import asyncio
import base64
import random
from typing import TYPE_CHECKING, Any

import httpx
import psutil
import pytest

from khala_agents.scripted.players import PLAYERS
from khala_protocol.messages import Observation, Reply
from khala_protocol.recording import Recording
from khala_sc2.openenv.client import KhalaAction, KhalaEnv, KhalaObservation
from khala_sc2.openenv.settings import ServerSettings

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractAsyncContextManager
    from pathlib import Path

    Serving = Callable[..., AbstractAsyncContextManager[str]]

pytestmark = pytest.mark.game
RAISES = pytest.raises


def skilled(text: str) -> str:
    return PLAYERS["skilled"](text, random.Random(f"0 {text}"))


def replies(seen: KhalaObservation) -> KhalaAction:
    return KhalaAction(replies={name: skilled(view.text) for name, view in seen.agents.items()})


async def played(env: KhalaEnv, **options: Any) -> list[KhalaObservation]:
    """Play an episode as the scripted player does."""
    seen = [(await env.reset(**options)).observation]
    while not seen[-1].done:
        seen.append((await env.step(replies(seen[-1]))).observation)
    return seen


def untimed(seen: list[KhalaObservation]) -> list[KhalaObservation]:
    return [one.model_copy(update={"episode_id": ""}) for one in seen]


async def test_a_team_plays_over_a_websocket_what_the_host_recorded(serving: Serving, tmp_path: Path) -> None:
    async with serving(ServerSettings(out=tmp_path)) as address, KhalaEnv(address) as env:
        seen = await played(env, seed=3, max_steps=3, images="screen", episode_id="first")
        state = await env.state()
        then = (await env.reset(max_steps=3, images="screen")).observation
        next_state = await env.state()
    assert (state.task, state.side, state.agents) == ("2s3z_pair", "blue", ["Stalkers", "Zealots"])
    assert (state.episode_id, state.step_count, state.over, state.seed) == ("first", 3, True, 3)
    first, *_, last = seen
    stalkers = first.agents["Stalkers"]
    assert [one.role for one in stalkers.briefing] == ["system", "user", "assistant"]
    assert stalkers.briefing[0].content.startswith("# Who you are\nYou are Stalkers")
    assert base64.b64decode(stalkers.pictures[0].data).startswith(b"\xff\xd8")
    assert all(view.briefing == [] for one in seen[1:] for view in one.agents.values())
    assert (last.agents, last.text, last.step) == ({}, "", 3)
    assert last.result is not None
    assert (last.result.outcome, last.result.cause) == ("cut", "step limit")
    assert sum(one.elapsed_s for one in seen) == pytest.approx(last.result.game_s, abs=0.1)
    assert last.reward == pytest.approx(-0.1 * last.elapsed_s / 60)
    assert then.agents["Stalkers"].briefing
    assert (next_state.seed, next_state.recording) == (4, state.recording)
    assert state.recording is not None
    recording = Recording.open(tmp_path / state.recording)
    observed = [one for one in recording.of(Observation) if one.episode == 0]
    assert [(one.agent, one.text) for one in observed] == [
        (name, view.text) for one in seen for name, view in one.agents.items()
    ]
    assert [one.text for one in recording.of(Reply, agent="Zealots")][:1] == [skilled(first.agents["Zealots"].text)]


@pytest.mark.slow
async def test_one_agent_plays_and_others_decide_for_the_rest(serving: Serving) -> None:
    async with serving() as address, KhalaEnv(address) as env:
        first = await env.reset(seed=1, agents=["Stalkers"], others="silent", max_steps=2)
        assert list(first.observation.agents) == ["Stalkers"]
        second = await env.step(KhalaAction(reply="Actions:\nTeam Stalker-1:\n<Move_Screen([9, 9])>\n<Nonsense()>"))
        seen = second.observation
        assert (seen.accepted, seen.refused) == (1, 1)
        assert seen.agents["Stalkers"].accepted == ["Stalker-1 <Move_Screen([9, 9])>"]
        (refused,) = seen.agents["Stalkers"].rejections
        assert refused.startswith("<Nonsense()>: There is no action Nonsense")
        assert seen.scores["legality"] == -0.5
        with RAISES(RuntimeError, match="this session does not play 'Zealots': it plays Stalkers"):
            await env.step(KhalaAction(replies={"Zealots": ""}))
        assert (await env.step(KhalaAction(reply=""))).done
        with RAISES(RuntimeError, match="the episode is over: call reset to begin the next one"):
            await env.step(KhalaAction(reply=""))


@pytest.mark.slow
async def test_sessions_are_apart_seeded_and_no_more_than_the_server_has(serving: Serving) -> None:
    options = {"seed": 5, "task": "2s3z", "max_steps": 3}
    before = psutil.Process().children(recursive=True)
    async with (
        serving(sessions=2) as address,
        KhalaEnv(address) as one,
        KhalaEnv(address) as other,
        KhalaEnv(address) as third,
    ):
        first, second = await asyncio.gather(played(one, **options), played(other, **options))
        assert untimed(first) == untimed(second)
        with RAISES(RuntimeError, match=r"at capacity: 2/2"):
            await third.reset()
        games = [child for child in psutil.Process().children(recursive=True) if child not in before]
        assert len(games) == 2
        assert untimed(await played(one, **options)) == untimed(first)
        now = psutil.Process().children(recursive=True)
        assert [child for child in now if child not in before] == games, "a seed is played in a process that is there"
    _, alive = await asyncio.to_thread(psutil.wait_procs, games, 10)
    assert not alive


@pytest.mark.slow
async def test_an_episode_over_http_has_a_name(serving: Serving) -> None:
    async with serving(sessions=2) as address, httpx.AsyncClient(base_url=address, timeout=60) as client:
        began = await client.post("/reset", json={"seed": 1, "task": "2s3z", "max_steps": 2})
        assert began.status_code == 200, began.text
        name = began.json()["observation"]["episode_id"]
        text = began.json()["observation"]["agents"]["CombatGroupSmac"]["text"]
        stepped = (await client.post("/step", json={"action": {"reply": skilled(text)}})).json()
        assert (stepped["done"], stepped["observation"]["step"]) == (False, 1)
        assert (await client.get("/state")).json()["step_count"] == 1
        await client.post("/reset", json={"episode_id": "mine", "seed": 2, "task": "2s3z"})
        unclear = await client.post("/step", json={"action": {"reply": ""}})
        assert unclear.status_code == 409
        assert unclear.json()["detail"].startswith("there are several episodes: say which one with episode_id")
        full = await client.post("/reset", json={})
        assert (full.status_code, "capacity" in full.json()["detail"]) == (503, True)
        assert (await client.post("/close", json={"episode_id": "mine"})).json() == {"episode_id": "mine"}
        ended = (await client.post("/step", json={"action": {"reply": ""}, "episode_id": name})).json()
        assert ended["observation"]["result"]["cause"] == "step limit"
        assert (await client.get("/state", params={"episode_id": "mine"})).status_code == 409
