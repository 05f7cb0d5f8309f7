"""Khala as an environment of verifiers: `vf-eval khala-verifiers`."""

from khala_verifiers.env import KhalaTeamConfig, KhalaTeamEnv, load_environment
from khala_verifiers.harness import KhalaHarness
from khala_verifiers.taskset import KhalaTaskset

__all__ = ["KhalaHarness", "KhalaTaskset", "KhalaTeamConfig", "KhalaTeamEnv", "load_environment"]
