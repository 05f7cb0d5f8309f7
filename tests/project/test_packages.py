"""The distributions as a user installs them: each in its own environment, from wheels, with plain pip."""

from __future__ import annotations

import functools
import json
import os
import re
import shutil
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BOTS = ROOT / "tests" / "simulator" / "live" / "python_sc2_bots.py"
MOCK_EVAL = ROOT / "tests" / "khala" / "mock_eval.py"
GAME_PARTS = {"numpy", "opencv-python-headless", "protobuf", "pygame", "pysc2", "scipy", "sk-video"}
AGENTS = ("agents", "configs", "protocol")
NEWEST_FIRST = ("3.13", "3.12", "3.11")
INSTALL_S = 3000
"""Seconds for a command; pip takes a minute where nothing else runs, and a quarter of an hour on a busy machine."""

pytestmark = [pytest.mark.slow, pytest.mark.timeout(7200)]

BOTH_IMPORTS = """
import agents
import khala_agents.policy

assert agents.Agent.__module__.startswith("agents.")

async def decide(briefing, observation):
    return khala_agents.policy.Decision("Actions:")
"""
MCP_CLIENT = """
import asyncio, sys
from mcp import Client, StdioServerParameters

async def play():
    words = ["mcp", "2s3z_pair", "--seat", "Stalkers", "--max-steps", "2"]
    async with Client(StdioServerParameters(command=sys.argv[1], args=words)) as client:
        seen = await client.call_tool("observe", {})
        print(seen.content[0].text)

asyncio.run(play())
"""
NUMERIC_STEP = """
from khala_sc2.env import numeric

env = numeric.parallel_env("3m")
env.reset(seed=1)
observations, rewards, *_ = env.step({agent: 1 for agent in env.agents})
print(sorted(rewards))
"""


@functools.cache
def python_of(version: str) -> str | None:
    """Return the interpreter of a version on this machine; None if there is none that starts."""
    pyenv = Path(os.environ.get("PYENV_ROOT") or "~/.pyenv").expanduser()
    named = (shutil.which(f"python{version}"), *map(str, sorted(pyenv.glob(f"versions/{version}.*/bin/python"))))
    for python in (sys.executable, *filter(None, named)):
        asked = [python, "-c", "import ensurepip, sys; print(*sys.version_info[:2], sep='.')"]
        if subprocess.run(asked, capture_output=True, text=True, check=False).stdout.strip() == version:
            return python
    return None


@functools.cache
def wheels_of(python: str, directory: Path, *, compiled: bool = True) -> Path:
    """Return a directory with a wheel of every distribution, as `make wheels` builds them for a Python."""
    engine = {} if compiled else {"KHALA_ENGINE": "python"}
    run("make", "--silent", "wheels", f"PYTHON={python}", f"DIST={directory}", cwd=ROOT, **engine)
    return directory


@pytest.fixture(scope="session")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the wheels for the Python of the tests."""
    return wheels_of(sys.executable, tmp_path_factory.getbasetemp() / "wheels")


def wheel(directory: Path, part: str) -> Path:
    """Return the wheel of a part; the front door is the part ``""``."""
    (found,) = directory.glob(f"khala_sc2{part and f'_{part}'}-*.whl")
    return found


class Environment:
    """A fresh environment in which some wheels and packages are installed."""

    def __init__(self, root: Path, *wanted: object, python: str = sys.executable) -> None:
        self.root = root
        run(python, "-m", "venv", root)
        self.install(*wanted)

    def install(self, *wanted: object) -> None:
        run(self.root / "bin" / "python", "-m", "pip", "install", "--quiet", "--no-compile", *wanted)

    def names(self) -> set[str]:
        """Return the installed distributions."""
        listed = run(self.root / "bin" / "python", "-m", "pip", "list", "--format", "json")
        return {package["name"].lower() for package in json.loads(listed)}

    def run(self, command: str, *arguments: object, cwd: Path, **environ: str) -> str:
        """Return the output of a command of this environment."""
        return run(self.root / "bin" / command, *arguments, cwd=cwd, **environ)


def environment(**more: str) -> dict[str, str]:
    """Return the environment variables without those that lead to this environment."""
    return {name: value for name, value in os.environ.items() if name not in {"PYTHONPATH", "VIRTUAL_ENV"}} | more


def run(*command: object, cwd: Path | None = None, **environ: str) -> str:
    """Return the output of a command, without this environment."""
    done = subprocess.run(
        [*map(str, command)],
        cwd=cwd, env=environment(**environ), capture_output=True, text=True, check=False, timeout=INSTALL_S,
    )  # fmt: skip
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


def test_every_door_opens_after_plain_pip_installed_a_folder(
    tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    python = next(filter(None, map(python_of, NEWEST_FIRST)))
    dist = wheels_of(python, tmp_path_factory.getbasetemp() / "dist", compiled=False)
    khala = Environment(tmp_path / "env", *sorted(dist.glob("*.whl")), python=python)
    cache = {"KHALA_CACHE": str(tmp_path / "cache")}

    (result,) = json.loads(khala.run("khala", "run", "2s3z_pair", "--json", cwd=tmp_path, **cache))["results"]
    assert (result["outcome"], result["valid"]) == ("win", True)

    with pytest.raises(AssertionError, match=r"is not installed; this installs it: \S*python\S* -m pip install 'mcp>="):
        khala.run("khala", "mcp", "2s3z_pair", cwd=tmp_path, **cache)
    khala.install("--find-links", dist, "khala-sc2[data,env,inspect,mcp]")

    seen = khala.run("python", "-c", MCP_CLIENT, khala.root / "bin" / "khala", cwd=tmp_path, **cache)
    assert "Team Stalker" in seen
    assert khala.run("python", "-c", NUMERIC_STEP, cwd=tmp_path).strip() == "['agent_0', 'agent_1', 'agent_2']"
    khala.run("khala", "dataset", "export", "runs", "--out", "rows", "--format", "parquet", cwd=tmp_path, **cache)
    assert list((tmp_path / "rows").rglob("*.parquet"))
    usage = json.dumps({"input_tokens": 100, "output_tokens": 10, "total_tokens": 110})
    options = json.dumps({"seeds": 1, "max_steps": 2, "images": "none"})
    khala.run("python", MOCK_EVAL, "2s3z_pair", "skilled", usage, options, cwd=tmp_path, **cache)
    assert list((tmp_path / "logs").glob("*.eval"))
    khala.install("--find-links", dist, "khala-sc2[openenv]")  # whose mcp is an older one
    check_openenv(khala, tmp_path)


def check_openenv(khala: Environment, place: Path) -> None:
    """Start `khala openenv`, and ask it whether it is well."""
    command = [str(khala.root / "bin" / "khala"), "openenv", "2s3z", "--port", "0"]
    with subprocess.Popen(command, cwd=place, env=environment(), stderr=subprocess.PIPE, text=True) as server:
        try:
            assert server.stderr is not None
            address = next(filter(None, (re.search(r"http://\S+", line) for line in server.stderr)))[0]
            with urllib.request.urlopen(f"{address.rstrip('/')}/health", timeout=60) as answer:
                assert json.load(answer)["status"] == "healthy"
        finally:
            server.terminate()


def test_an_agent_is_installed_without_a_game_and_plays(wheels: Path, tmp_path: Path) -> None:
    alone = Environment(tmp_path / "env", *(wheel(wheels, part) for part in AGENTS))
    assert not alone.names() & GAME_PARTS
    host = [sys.executable, "-m", "khala_sc2", "host", "2s3z", "--run", "alone", "--max-steps", "3", "--json"]
    socket = f"unixsock-stream/{tmp_path / 'bus'}"
    with subprocess.Popen(
        [*host, "--listen", socket], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        alone.run(
            "khala-agent", "CombatGroupSmac", "--run", "alone", "--policy", "silent", "--connect", socket, cwd=tmp_path
        )
        assert process.stdout is not None
        (result,) = json.load(process.stdout)["results"]
    assert result["statuses"] == {"CombatGroupSmac": {"ok": 3}}


def test_khala_and_the_openai_agents_sdk_share_an_environment(wheels: Path, tmp_path: Path) -> None:
    both = Environment(tmp_path / "env", *sorted(wheels.glob("*.whl")), "openai-agents")
    (tmp_path / "both.py").write_text(BOTH_IMPORTS)
    options = ("--policy", "both:decide", "--max-steps", "3", "--json")
    printed = both.run("khala", "run", "2s3z", *options, cwd=tmp_path, KHALA_CACHE=str(tmp_path / "cache"))
    (result,) = json.loads(printed)["results"]
    assert result["statuses"] == {"CombatGroupSmac": {"ok": 3}}


def test_python_sc2_plays_on_the_simulator_alone(wheels: Path, tmp_path: Path) -> None:
    game = Environment(tmp_path / "env", wheel(wheels, "simulator"), "burnysc2")
    assert not {name for name in game.names() if name.startswith("khala")} - {"khala-sc2-simulator"}
    game.run("khala-sc2", "install", tmp_path / "sc2", cwd=tmp_path)
    game.run("python", BOTS, "combat", tmp_path / "seen.json", cwd=tmp_path, SC2PATH=str(tmp_path / "sc2"))
    assert json.loads((tmp_path / "seen.json").read_text())["killed"] > 0
