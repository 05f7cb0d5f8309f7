"""The distributions as a user installs them: each in its own environment, from wheels."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BOTS = ROOT / "tests" / "simulator" / "live" / "python_sc2_bots.py"
UV = shutil.which("uv") or str(ROOT / ".uv" / "bin" / "uv")
GAME_PARTS = {"numpy", "opencv-python-headless", "protobuf", "pygame", "pysc2", "scipy", "sk-video"}

pytestmark = pytest.mark.slow

BOTH_IMPORTS = """
import agents
import khala_agents.policy

assert agents.Agent.__module__.startswith("agents.")

async def decide(briefing, observation):
    return khala_agents.policy.Decision("Actions:")
"""


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a directory with a wheel of every distribution."""
    out = tmp_path_factory.mktemp("wheels")
    run(UV, "build", "--quiet", "--all-packages", "--wheel", "--out-dir", out, cwd=ROOT)
    return out


class Environment:
    """A fresh environment in which some distributions are installed."""

    def __init__(self, root: Path, wheels: Path, *distributions: str) -> None:
        self.root = root
        run(UV, "venv", "--quiet", "--python", sys.executable, root)
        run(UV, "pip", "install", "--quiet", "--python", self.python, "--find-links", wheels, *distributions)

    @property
    def python(self) -> Path:
        return self.root / "bin" / "python"

    def names(self) -> set[str]:
        """Return the installed distributions."""
        listed = run(UV, "pip", "list", "--quiet", "--format", "json", "--python", self.python)
        return {package["name"].lower() for package in json.loads(listed)}

    def run(self, command: str, *arguments: object, cwd: Path, **environ: str) -> str:
        """Return the output of a command of this environment."""
        return run(self.root / "bin" / command, *arguments, cwd=cwd, **environ)


def run(*command: object, cwd: Path | None = None, **environ: str) -> str:
    """Return the output of a command, without this environment."""
    inherited = {name: value for name, value in os.environ.items() if name not in {"PYTHONPATH", "VIRTUAL_ENV"}}
    done = subprocess.run(
        [*map(str, command)], cwd=cwd, env=inherited | environ, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


def test_an_agent_is_installed_without_a_game_and_plays(wheels: Path, tmp_path: Path) -> None:
    alone = Environment(tmp_path / "env", wheels, "khala-sc2-agents")
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
    both = Environment(tmp_path / "env", wheels, "khala-sc2", "openai-agents")
    (tmp_path / "both.py").write_text(BOTH_IMPORTS)
    options = ("--policy", "both:decide", "--max-steps", "3", "--json")
    printed = both.run("khala", "run", "2s3z", *options, cwd=tmp_path, KHALA_CACHE=str(tmp_path / "cache"))
    (result,) = json.loads(printed)["results"]
    assert result["statuses"] == {"CombatGroupSmac": {"ok": 3}}


def test_python_sc2_plays_on_the_simulator_alone(wheels: Path, tmp_path: Path) -> None:
    game = Environment(tmp_path / "env", wheels, "khala-sc2-simulator", "burnysc2")
    assert not {name for name in game.names() if name.startswith("khala")} - {"khala-sc2-simulator"}
    game.run("khala-sc2", "install", tmp_path / "sc2", cwd=tmp_path)
    game.run("python", BOTS, "combat", tmp_path / "seen.json", cwd=tmp_path, SC2PATH=str(tmp_path / "sc2"))
    assert json.loads((tmp_path / "seen.json").read_text())["killed"] > 0
