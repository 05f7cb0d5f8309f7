"""PySC2's own game tests, unmodified, on an install of the simulator.

All of them are listed, in the order of the time they take.
"""

import pkgutil
import unittest
from collections.abc import Iterator
from pathlib import Path

import pysc2.tests
import pytest

pytestmark = pytest.mark.game

PASSED = [
    "ping_test.TestPing.test_ping",
    "protocol_error_test.TestProtocolError.test_error",
    "protocol_error_test.TestProtocolError.test_replay_a_replay",
    "general_actions_test.TestGeneralActions.test_general_actions",
    "debug_test.DebugTest.test_multi_player",
    "versions_test.TestVersions.test_version_numbers",
    "versions_test.TestVersions.test_versions_create_game",
    "render_test.TestRender.test_render",
    "step_mul_override_test.StepMulOverrideTest.test_returns_game_loop_zero_on_first_step_despite_override",
    "step_mul_override_test.StepMulOverrideTest.test_respects_override",
    "obs_test.ObsTest.test_camera_movement_delay",
    "obs_test.ObsTest.test_action_delay",
    "multi_player_test.TestMultiplayer.test_multi_player",
    "obs_test.ObsTest.test_fog",
    "obs_test.ObsTest.test_pos",
    "obs_spec_test.TestObservationSpec.test_observation_matches_obs_spec",
    "host_remote_agent_test.TestHostRemoteAgent.testVsBot",
    "actions_test.ActionsTest.test_general_attack",
    "obs_test.ObsTest.test_hallucination",
    "obs_test.ObsTest.test_effects",
    "obs_test.ObsTest.test_hide_cloaked",
    "obs_test.ObsTest.test_show_cloaked",
    "obs_test.ObsTest.test_active",
    "obs_test.ObsTest.test_disable_fog",
    "random_agent_test.TestRandomAgent.test_random_agent_features",
    "obs_spec_test.TestObservationSpec.test_heterogeneous_observations",
    "host_remote_agent_test.TestHostRemoteAgent.testVsAgent",
    "multi_player_env_test.TestMultiplayerEnv.test_multi_player_env_passthrough_and_features",
]
SLOW = [
    "multi_player_env_test.TestMultiplayerEnv.test_multi_player_env_features_and_rgb",
    "multi_player_env_test.TestMultiplayerEnv.test_multi_player_env_features",
    "multi_player_env_test.TestMultiplayerEnv.test_multi_player_env_rgb",
    "random_agent_test.TestRandomAgent.test_random_agent_rgb",
    "random_agent_test.TestRandomAgent.test_random_agent_all",
    "easy_scripted_test.TestEasy.test_move_to_beacon",
    "easy_scripted_test.TestEasy.test_collect_mineral_shards",
    "easy_scripted_test.TestEasy.test_collect_mineral_shards_raw",
    "easy_scripted_test.TestEasy.test_collect_mineral_shards_feature_units",
    "easy_scripted_test.TestEasy.test_defeat_roaches",
    "easy_scripted_test.TestEasy.test_defeat_roaches_raw",
    "replay_obs_test.ReplayObsTest.test_replay_observations_match",
]
WITHOUT_A_GAME = {"dummy_observation_test"}


def _all_tests() -> Iterator[str]:
    for module in pkgutil.iter_modules(pysc2.tests.__path__):
        if module.name.endswith("_test") and module.name not in WITHOUT_A_GAME:
            for case in unittest.defaultTestLoader.loadTestsFromName(f"pysc2.tests.{module.name}"):
                assert isinstance(case, unittest.TestSuite)
                for test in case:
                    assert isinstance(test, unittest.TestCase)
                    yield test.id().removeprefix("pysc2.tests.")


@pytest.mark.filterwarnings("ignore")  # of PySC2 and what it imports
def test_every_game_test_of_pysc2_is_listed_once() -> None:
    assert sorted([*PASSED, *SLOW]) == sorted(_all_tests())


@pytest.mark.parametrize("name", [*PASSED, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)])
@pytest.mark.filterwarnings("ignore")  # of PySC2 and what it imports
def test_pysc2_says_ok(name: str, sc2: Path, no_process_left: None) -> None:
    suite = unittest.defaultTestLoader.loadTestsFromName(f"pysc2.tests.{name}")
    result = unittest.TestResult()
    suite.run(result)
    assert result.testsRun == 1
    assert not [trace for _, trace in result.errors + result.failures]
