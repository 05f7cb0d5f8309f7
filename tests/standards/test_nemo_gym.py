"""The resources server for NeMo Gym: the standard's own checks, in an environment of its own."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BIN = ROOT / ".venv-nemo-gym/bin"
PROJECT = ROOT / "envs/khala_nemo_gym"
SERVER = PROJECT / "resources_servers/khala_starcraft"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(600),
    pytest.mark.skipif(not (BIN.parent / ".ready").exists(), reason="`make standards` makes the environment"),
]


def run(*words: str, cwd: Path) -> str:
    """Run a program of the environment, and return what it printed."""
    done = subprocess.run(
        [BIN / words[0], *words[1:]], cwd=cwd, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(PROJECT), "KHALA_ENGINE": "python"},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_gym_env_validate_takes_the_configuration() -> None:
    said = run("gym", "env", "validate", "--resources-server", "khala_starcraft", cwd=PROJECT)
    assert "Config is valid" in said


def test_the_tests_that_gym_env_test_runs_pass_with_the_contract_of_sessions() -> None:
    """`gym env test` runs them in an environment that it makes of `requirements.txt`; here Khala is not on PyPI yet."""
    said = run("python", "-m", "pytest", "-q", "-p", "no:cacheprovider", cwd=SERVER)
    assert "7 passed" in said
