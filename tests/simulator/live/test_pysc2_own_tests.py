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

SHORT = [
    "tests.ping_test.TestPing.test_ping",
    "tests.obs_spec_test.TestObservationSpec.test_observation_matches_obs_spec",
]
SLOW = [
    "tests.protocol_error_test.TestProtocolError.test_error",
    "tests.general_actions_test.TestGeneralActions.test_general_actions",
    "tests.render_test.TestRender.test_render",
    "tests.step_mul_override_test.StepMulOverrideTest.test_respects_override",
    "tests.obs_test.ObsTest.test_camera_movement_delay",
    "tests.protocol_error_test.TestProtocolError.test_replay_a_replay",
    "tests.debug_test.DebugTest.test_multi_player",
    "tests.versions_test.TestVersions.test_version_numbers",
    "tests.versions_test.TestVersions.test_versions_create_game",
    "tests.step_mul_override_test.StepMulOverrideTest.test_returns_game_loop_zero_on_first_step_despite_override",
    "tests.multi_player_test.TestMultiplayer.test_multi_player",
    "tests.obs_test.ObsTest.test_show_cloaked",
    "tests.obs_test.ObsTest.test_action_delay",
    "tests.obs_test.ObsTest.test_fog",
    "tests.obs_test.ObsTest.test_pos",
    "tests.host_remote_agent_test.TestHostRemoteAgent.testVsBot",
    "tests.actions_test.ActionsTest.test_general_attack",
    "tests.obs_test.ObsTest.test_hallucination",
    "tests.obs_test.ObsTest.test_effects",
    "tests.obs_test.ObsTest.test_hide_cloaked",
    "tests.obs_test.ObsTest.test_active",
    "tests.obs_test.ObsTest.test_disable_fog",
    "tests.random_agent_test.TestRandomAgent.test_random_agent_features",
    "tests.host_remote_agent_test.TestHostRemoteAgent.testVsAgent",
    "env.mock_sc2_env_comparison_test.TestCompareEnvironments.test_action_spec",
    "env.mock_sc2_env_comparison_test.TestCompareEnvironments.test_observation_spec",
    "tests.obs_spec_test.TestObservationSpec.test_heterogeneous_observations",
    "tests.multi_player_env_test.TestMultiplayerEnv.test_multi_player_env_passthrough_and_features",
    "tests.multi_player_env_test.TestMultiplayerEnv.test_multi_player_env_features_and_rgb",
    "tests.multi_player_env_test.TestMultiplayerEnv.test_multi_player_env_features",
    "tests.multi_player_env_test.TestMultiplayerEnv.test_multi_player_env_rgb",
    "tests.random_agent_test.TestRandomAgent.test_random_agent_rgb",
    "tests.random_agent_test.TestRandomAgent.test_random_agent_all",
    "tests.easy_scripted_test.TestEasy.test_move_to_beacon",
    "tests.easy_scripted_test.TestEasy.test_collect_mineral_shards",
    "tests.easy_scripted_test.TestEasy.test_collect_mineral_shards_raw",
    "tests.easy_scripted_test.TestEasy.test_collect_mineral_shards_feature_units",
    "tests.easy_scripted_test.TestEasy.test_defeat_roaches",
    "tests.easy_scripted_test.TestEasy.test_defeat_roaches_raw",
    "tests.replay_obs_test.ReplayObsTest.test_replay_observations_match",
    "tests.observer_test.TestObserver.test_observer",
]
WITHOUT_A_GAME = {"tests.dummy_observation_test"}


def _all_tests() -> Iterator[str]:
    found = (f"tests.{module.name}" for module in pkgutil.iter_modules(pysc2.tests.__path__))
    modules = [name for name in found if name.endswith("_test") and name not in WITHOUT_A_GAME]
    for module in [*modules, "env.mock_sc2_env_comparison_test"]:
        for case in unittest.defaultTestLoader.loadTestsFromName(f"pysc2.{module}"):
            assert isinstance(case, unittest.TestSuite)
            for test in case:
                assert isinstance(test, unittest.TestCase)
                yield test.id().removeprefix("pysc2.")


@pytest.mark.filterwarnings("ignore")  # of PySC2 and what it imports
def test_every_game_test_of_pysc2_is_listed_once() -> None:
    assert sorted([*SHORT, *SLOW]) == sorted(_all_tests())


@pytest.mark.parametrize("name", [*SHORT, *(pytest.param(name, marks=pytest.mark.slow) for name in SLOW)])
@pytest.mark.filterwarnings("ignore")  # of PySC2 and what it imports
def test_pysc2_says_ok(name: str, sc2: Path, no_process_left: None) -> None:
    suite = unittest.defaultTestLoader.loadTestsFromName(f"pysc2.{name}")
    result = unittest.TestResult()
    suite.run(result)
    assert result.testsRun == 1
    assert not [trace for _, trace in result.errors + result.failures]
