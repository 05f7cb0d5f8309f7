"""The environments pass the tests of the standards whose interfaces they have, by PettingZoo and Gymnasium."""

from __future__ import annotations

import warnings

import gymnasium
import pytest
from gymnasium.utils.env_checker import check_env

from khala_sc2.env import numeric

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # its tests import environments of its own, which warn
    from pettingzoo.test import api_test, max_cycles_test, parallel_api_test, parallel_seed_test, seed_test

masked = pytest.mark.filterwarnings("ignore:Observation:UserWarning")
"""PettingZoo's documents have observations with a mask of actions, and its test notes that they are no arrays."""
MAPS = ["3m", *(pytest.param(name, marks=pytest.mark.slow) for name in numeric.MAPS if name != "3m")]


@pytest.mark.parametrize("name", MAPS)
def test_numeric_parallel_env_passes_the_parallel_api_test(name: str) -> None:
    parallel_api_test(numeric.parallel_env(name), num_cycles=200)


@pytest.mark.parametrize("name", MAPS)
def test_numeric_parallel_env_passes_the_parallel_seed_test(name: str) -> None:
    parallel_seed_test(lambda: numeric.parallel_env(name), num_cycles=20)


def test_numeric_envs_pass_the_max_cycles_test() -> None:
    max_cycles_test(numeric)


@masked
@pytest.mark.parametrize("name", MAPS)
def test_numeric_env_passes_the_api_test(name: str) -> None:
    api_test(numeric.env(name), num_cycles=100)


def test_numeric_env_passes_the_seed_test() -> None:
    seed_test(lambda: numeric.env("3m"), num_cycles=20)


@pytest.mark.parametrize("name", MAPS)
def test_central_env_passes_gymnasiums_check(name: str) -> None:
    made = gymnasium.make(f"khala_sc2.env.numeric:khala-smac/{name}-v0", render_mode="rgb_array")
    check_env(made.unwrapped)
