"""An install of the simulator, and PySC2 pointed at it."""

import os
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from absl import flags

from khala_bridge.compat import maps, sc2_env
from khala_simulator.process.install import install

if not flags.FLAGS.is_parsed():
    flags.FLAGS(["pytest"])


class Map2s3z(maps.Map):  # type: ignore[misc]  # PySC2 has no types
    directory = "llm_smac"
    filename = "2s3z"
    players = 2


class Map3s5z(Map2s3z):
    filename = "3s5z"


class Map2cVs64zg(Map2s3z):
    filename = "2c_vs_64zg"


@pytest.fixture(scope="session")
def install_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install(tmp_path_factory.mktemp("sc2"))


@pytest.fixture
def sc2(install_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SC2PATH", str(install_path))
    return install_path


@pytest.fixture
def make_env(sc2: Path) -> Iterator[Callable[..., Any]]:  # the install must be in place first
    """Yield a function that starts environments; close them when the test is over."""
    made = []

    def make(map_name: str = "Map2s3z", **options: Any) -> Any:
        layers = sc2_env.AgentInterfaceFormat(
            feature_dimensions=sc2_env.Dimensions(screen=128, minimap=64),
            use_feature_units=True,
            use_raw_units=True,
            use_camera_position=True,
        )
        players = [sc2_env.Agent(sc2_env.Race.protoss), sc2_env.Bot(sc2_env.Race.random, sc2_env.Difficulty.very_hard)]
        usual = {"players": players, "agent_interface_format": layers, "step_mul": 8, "random_seed": 1}
        env = sc2_env.SC2Env(map_name=map_name, **{**usual, **options})
        made.append(env)
        return env

    yield make
    for env in made:
        env.close()


@pytest.fixture
def no_process_left(install_path: Path) -> Iterator[None]:
    """Fail the test if a game process of this install outlives it."""
    yield
    found = [process.name for process in Path("/proc").glob("[0-9]*") if str(install_path) in _command_line(process)]
    assert not found


def _command_line(process: Path) -> str:
    try:
        return (process / "cmdline").read_bytes().decode(errors="replace")
    except OSError:
        return ""


@pytest.fixture
def launch(sc2: Path) -> Iterator[Callable[..., subprocess.Popen[bytes]]]:
    """Yield a function that starts the game as clients do; end it when the test is over.

    It is not covered: coverage writes what it has from within the handler of a signal. If the signal came while it was
    at work, it waits for itself, and the process does not end.
    """
    started = []
    environ = {name: value for name, value in os.environ.items() if not name.startswith("COVERAGE_")}

    def start(port: int, *arguments: str) -> subprocess.Popen[bytes]:
        command = [str(sc2 / "Versions/Base75689/SC2_x64"), "-listen", "127.0.0.1", "-port", str(port)]
        command += ["-dataDir", f"{sc2}/", "-tempDir", "/nonexistent/", *arguments]
        process = subprocess.Popen(command, env=environ)
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.wait()
