"""PySC2's own game tests, unmodified, as far as the simulator passes them.

They ask for maps that are not shipped yet. Those here test the API and not the rules of a map, so they run on
stand-ins: a scenario of a few units under the map's name, as a user would add one.
"""

import unittest
from pathlib import Path

import pytest

from simulator.install import install

pytestmark = pytest.mark.game

STAND_IN = """# A map of Khala's simulator
name: {name}
family: stand_in
title: A few units under the name of a map that is not shipped
terrain: agria_open
visibility: {{fog: false, black_mask: false}}
players:
  1: {{race: random, control: agent, start: [8, 16]}}
  2: {{race: random, control: computer, start: [24, 16]}}
triggers:
  - name: spawn
    when: [start]
    do:
      - create: {{player: 1, unit: Zealot, count: 5, at: [8, 16]}}
      - create: {{player: 2, unit: Zealot, count: 5, at: [24, 16]}}
"""
MAPS = [f"Melee/{kind}{size}" for kind in ("Simple", "Flat") for size in (32, 48, 64, 96, 128)]


@pytest.fixture(scope="module")
def stand_ins(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = install(tmp_path_factory.mktemp("stand_ins"))
    for path in (*MAPS, "mini_games/DefeatRoaches"):
        file = root / "Maps" / f"{path}.SC2Map"
        file.write_text(STAND_IN.format(name=file.stem))
    return root


@pytest.mark.parametrize(
    "name",
    [
        "ping_test.TestPing.test_ping",
        "versions_test.TestVersions.test_version_numbers",
        "versions_test.TestVersions.test_versions_create_game",
        "protocol_error_test.TestProtocolError.test_error",
        "protocol_error_test.TestProtocolError.test_replay_a_replay",
        "host_remote_agent_test.TestHostRemoteAgent.testVsBot",
        "obs_spec_test.TestObservationSpec.test_observation_matches_obs_spec",
        "random_agent_test.TestRandomAgent.test_random_agent_features",
        "step_mul_override_test.StepMulOverrideTest.test_returns_game_loop_zero_on_first_step_despite_override",
        "step_mul_override_test.StepMulOverrideTest.test_respects_override",
        "general_actions_test.TestGeneralActions.test_general_actions",
        "debug_test.DebugTest.test_multi_player",
    ],
)
@pytest.mark.filterwarnings("ignore")  # of PySC2 and what it imports
def test_pysc2_says_ok(name: str, stand_ins: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SC2PATH", str(stand_ins))
    suite = unittest.defaultTestLoader.loadTestsFromName(f"pysc2.tests.{name}")
    result = unittest.TestResult()
    suite.run(result)
    assert result.testsRun == 1
    assert not [trace for _, trace in result.errors + result.failures]
