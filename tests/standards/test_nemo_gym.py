"""The resources server for NeMo Gym: the standard's own checks, in an environment of its own."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BIN = ROOT / ".venv-nemo-gym/bin"
PROJECT = ROOT / "envs/khala_nemo_gym"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.timeout(600),
    pytest.mark.skipif(not (BIN.parent / ".ready").exists(), reason="`make standards` makes the environment"),
]


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Return a copy of the project: `gym` writes into it."""
    return shutil.copytree(PROJECT, tmp_path / "project")


def run(*words: str, cwd: Path, project: Path) -> str:
    """Run a program of the environment, and return what it printed."""
    done = subprocess.run(
        [BIN / words[0], *words[1:]], cwd=cwd, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(project), "KHALA_ENGINE": "python"},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_gym_env_validate_takes_the_configuration(project: Path) -> None:
    said = run("gym", "env", "validate", "--resources-server", "khala_starcraft", cwd=project, project=project)
    assert "Config is valid" in said


def test_the_tests_that_gym_env_test_runs_pass_with_the_contract_of_sessions(project: Path) -> None:
    """`gym env test` makes an environment of `requirements.txt` first; Khala is not on PyPI yet."""
    said = run("python", "-m", "pytest", "-q", cwd=project / "resources_servers/khala_starcraft", project=project)
    assert "7 passed" in said
