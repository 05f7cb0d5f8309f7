"""What a server lets its clients choose, and what it says of wrong choices."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import httpx
import pytest
from openenv.cli.commands.validate import validate
from openenv.core.rubrics import Rubric

from khala_protocol.errors import ConfigError, KhalaError
from khala_protocol.messages import Casualties, Report, Result
from khala_sc2.env.rewards import battle
from khala_sc2.openenv.commands import WantedServer, rubric_of, run_openenv, settings_of
from khala_sc2.openenv.environment import KhalaEnvironment
from khala_sc2.openenv.models import KhalaAction, KhalaObservation, Outcome, ResetOptions
from khala_sc2.openenv.rubrics import Battle
from khala_sc2.openenv.server import app_of
from khala_sc2.openenv.settings import ServerSettings
from khala_sc2.playing.seats import Seat

if TYPE_CHECKING:
    from pathlib import Path

WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "option": ({"agent": ["Stalkers"]}, "reset:1 (agent): no such field, did you mean 'agents'?"),
    "seed": ({"seed": -1}, "reset:1 (seed): input should be greater than or equal to 0, not -1"),
    "task": ({"task": "2s3zz"}, "there is no task '2s3zz': did you mean 2s3z?"),
    "file": ({"task": "../x.yaml"}, "task: '../x.yaml' is not the name of a task: `khala tasks` lists them"),
    "agent": ({"agents": ["Me"]}, "agents: there is no Me: give one of blue/Stalkers, blue/Zealots"),
    "sides": (
        {"task": "duel_3m", "agents": ["blue/Captain", "red/Captain"]},
        "agents: a session plays agents of one side: `others` decide for the other one",
    ),
    "others": (
        {"others": "openai"},
        "others: this server does not let a client choose 'openai': it may be one of focus-fire, ",
    ),
    "code": ({"others": "os:abort"}, "others: this server does not let a client choose 'os:abort'"),
    "images": ({"images": "screem"}, "command line: "),
}


@pytest.mark.parametrize("name", WRONG)
async def test_a_wrong_option_of_reset_is_one_sentence(name: str) -> None:
    options, sentence = WRONG[name]
    with pytest.raises(KhalaError, match=f"^{re.escape(sentence)}"):
        await KhalaEnvironment().reset_async(**options)


async def test_there_is_no_step_before_a_reset_and_nothing_after_the_end() -> None:
    environment = KhalaEnvironment()
    with pytest.raises(KhalaError, match="no episode has begun: call reset first"):
        await environment.step_async(KhalaAction(reply=""))
    with pytest.raises(KhalaError, match="no episode has begun: call reset first"):
        environment.step(KhalaAction(reply=""))
    environment.close()
    with pytest.raises(KhalaError, match="this session was closed, or did nothing for too long: connect again"):
        await environment.reset_async()


def test_a_session_plays_the_first_side_unless_it_names_another_agent() -> None:
    settings = ServerSettings(task="duel_3m", allowed=("openai",))
    assert settings.match(ResetOptions()).match.seats == (Seat("blue", "Captain"),)
    red = ResetOptions(agents=["red/Captain"], others="focus-fire", max_steps=7, seed=9)
    match, config = settings.match(red)
    assert match.seats == (Seat("red", "Captain"),)
    assert (config.seed, config.task.max_steps, config.task.clock.max_wait_s, config.record) == (9, 7, None, None)


async def test_http_says_what_is_wrong_with_a_status_of_its_own() -> None:
    transport = httpx.ASGITransport(app_of())
    async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
        early = await client.post("/step", json={"action": {"reply": ""}})
        assert (early.status_code, early.json()) == (
            409,
            {"detail": "there is no episode of this client: call reset first, and give the episode_id that it returns"},
        )
        wrong = await client.post("/reset", json={"sead": 1})
        assert wrong.status_code == 422
        assert wrong.json()["detail"].startswith("reset:1 (sead): no such field, did you mean 'seed'?")
        no_action = await client.post("/step", json={"action": {"words": ""}})
        assert no_action.status_code == 422
        paths = (await client.get("/openapi.json")).json()["paths"]
    assert {"/reset", "/step", "/state", "/close", "/schema", "/metadata", "/health", "/mcp"} <= paths.keys()


# --- rewards ------------------------------------------------------------------------------------------


def observed(outcome: str | None = None, **fields: Any) -> KhalaObservation:
    ended = {"cause": "", "valid": True, "killed_value": 0, "lost_value": 0, "steps": 1, "game_s": 1}
    result = None if outcome is None else Outcome.model_validate({"outcome": outcome, **ended})
    return KhalaObservation(result=result, **fields)


@pytest.mark.parametrize(
    ("seen", "scores", "reward"),
    [
        (observed(), (0, 0, 0, 0), 0),
        (observed("win", killed_value=500, lost_value=200), (1, 0.3, 0, 0), 1.3),
        (observed("loss", lost_value=100, elapsed_s=30), (-1, -0.1, 0, -0.5), -1.15),
        (observed("draw", accepted=3, refused=1), (0, 0, -0.25, 0), -0.025),
    ],
)
def test_the_reward_is_a_weighted_sum_of_four_rubrics(
    seen: KhalaObservation, scores: tuple[float, ...], reward: float
) -> None:
    rubric = Battle()
    assert rubric(KhalaAction(), seen) == pytest.approx(reward)
    parts = {name: part.last_score for name, part in rubric.named_rubrics()}
    assert parts == pytest.approx(dict(zip(("win", "value", "legality", "tempo"), scores, strict=True)))


def test_win_and_value_alone_are_the_reward_of_the_other_environments() -> None:
    report = Report(run="r", episode=0, step=0, game_loop=1, agents=(), killed_value=300.0, lost_value=50.0)
    none = Casualties()
    result = Result(
        run="r", episode=0, outcome="win", cause="", steps=1, game_loop=1, game_s=1, wall_s=1, killed=none, lost=none,
        kd=None,
    )  # fmt: skip
    seen = observed("win", killed_value=300.0, lost_value=50.0)
    assert Battle(legality=0, tempo=0)(KhalaAction(), seen) == battle([report], result)


MINE = """
from openenv.core.rubrics import Rubric
class Mine(Rubric):
    def forward(self, action, observation):
        return 7.0
made = Mine()
number = int
"""


@pytest.fixture
def rewards(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Write a module of the user's, and return its name."""
    name = f"rewards_{os.getpid()}"
    (tmp_path / f"{name}.py").write_text(MINE)
    monkeypatch.syspath_prepend(tmp_path)
    return name


def test_a_user_gives_a_rubric_by_name(rewards: str) -> None:
    made = rubric_of(f"{rewards}:Mine")()
    assert isinstance(made, Rubric)
    assert made(None, None) == 7.0
    for name, sentence in {
        "made": "give a class or a function that makes a rubric: each session has its own",
        "number": "it makes no openenv.core.rubrics.Rubric",
        "none": f"the module {rewards} has no 'none'",
    }.items():
        with pytest.raises(ConfigError, match=re.escape(f"rubric {rewards}:{name}: {sentence}")):
            rubric_of(f"{rewards}:{name}")
    with pytest.raises(ConfigError, match="rubric mine: write module:name, such as my_rewards:Mine"):
        rubric_of("mine")


# --- the command --------------------------------------------------------------------------------------


def wanted(**changes: Any) -> WantedServer:
    plain: dict[str, Any] = {
        "task": "2s3z_pair", "host": "127.0.0.1", "port": 0, "sessions": 8, "idle_s": 60.0, "others": "skilled",
        "allow": (), "rubric": None, "game": "simulator", "out": None,
    }  # fmt: skip
    return WantedServer(**plain | changes)


def test_the_command_finds_what_is_wrong_before_it_serves() -> None:
    assert settings_of(wanted(allow=("focus-fire",))).allowed == ("focus-fire",)
    with pytest.raises(ConfigError, match="there is no task 'nothing'"):
        settings_of(wanted(task="nothing"))
    with pytest.raises(ConfigError, match="no_module"):
        settings_of(wanted(allow=("no_module:decide",)))
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(ConfigError, match=f"--port: cannot listen on 127.0.0.1:{port}: "):
            run_openenv(wanted(port=port))


def test_openenv_is_named_if_it_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "khala_sc2.openenv.server", None)
    with pytest.raises(ConfigError, match=re.escape("pip install 'khala-sc2[openenv]'")):
        run_openenv(wanted())


@pytest.mark.slow
def test_openenv_validates_the_server_that_runs() -> None:
    command = [sys.executable, "-m", "khala_sc2", "openenv", "--port", "0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        address = process.stderr.readline().strip()
        try:
            validate(None, url=address, json_output=False, timeout=20.0, verbose=False)
        finally:
            process.send_signal(signal.SIGTERM)
        assert process.wait(20) in {-signal.SIGTERM, 128 + signal.SIGTERM}
