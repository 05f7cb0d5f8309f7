"""Programs that use PySC2, run by the simulator's own door, without the rest of Khala."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from khala_simulator.pysc2 import main

PROGRAM = """
import sys
from absl import app
from pysc2.env import sc2_env
from pysc2.lib import actions
assert not any(name.startswith("khala_bridge") for name in sys.modules)

def play(arguments):
    interface = sc2_env.AgentInterfaceFormat(feature_dimensions=sc2_env.Dimensions(screen=64, minimap=64))
    with sc2_env.SC2Env(map_name="DefeatRoaches", players=[sc2_env.Agent(sc2_env.Race.terran)],
                        agent_interface_format=interface, random_seed=3) as env:
        first = env.reset()[0]
        last = env.step([actions.FUNCTIONS.no_op()])[0]
        print(arguments[1:], first.observation.player.army_count, int(last.observation.game_loop[0]))

app.run(play)
"""


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-W", "ignore", "-m", "khala_simulator.pysc2", *arguments],
        env=os.environ | {"PYGAME_HIDE_SUPPORT_PROMPT": "1"}, capture_output=True, text=True, timeout=100, check=False,
    )  # fmt: skip


@pytest.mark.game
@pytest.mark.usefixtures("sc2", "no_process_left")
def test_a_program_with_an_sc2env_of_its_own_plays_on_the_simulator(tmp_path: Path) -> None:
    program = tmp_path / "mine.py"
    program.write_text(PROGRAM)
    done = run(program, "x", "--sc2_verbose_protocol=0")
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "['x'] 9 8"


@pytest.mark.slow
def test_a_module_of_pysc2_runs_under_its_name() -> None:
    done = run("-m", "pysc2.bin.agent", "--help")
    assert "--map" in done.stdout, done.stderr


def test_what_is_not_there_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["missing.py"])
    assert ended.value.code == "there is no program missing.py; a module is named with -m"
    with pytest.raises(SystemExit) as helped:
        main(["--help"])
    assert helped.value.code == 0
    assert "my_program.py" in capsys.readouterr().out
