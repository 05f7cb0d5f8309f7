"""What a process imports before it can do its work: no more than it uses."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = {
    "aiohttp", "asyncio", "cryptography", "httpx", "khala_bridge", "markdown_it", "mcap", "numpy", "psutil", "pydantic",
    "pygments", "pysc2", "s2clientprotocol", "scipy", "yaml", "zenoh",
}  # fmt: skip
"""What takes 20 ms and more to import."""
SHOW = "import sys; print('imported', *sys.modules, file=sys.stderr)"


def imported(script: str) -> set[str]:
    """Return the names of the modules that a new process has when it has run a script."""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60)
    return set(done.stderr.rpartition("imported ")[2].split())


@pytest.mark.parametrize(
    ("arguments", "of_typer"),
    [(["--help"], set()), (["--version"], set()), (["run", "--help"], {"markdown_it", "pydantic", "pygments"})],
)
def test_help_imports_options_and_nothing_that_is_needed_to_play(arguments: list[str], of_typer: set[str]) -> None:
    script = f"import khala_sc2.cli\ntry: khala_sc2.cli.main({arguments})\nexcept SystemExit: pass\n{SHOW}"
    assert imported(script) & HEAVY == of_typer


def test_an_agent_imports_no_game_and_no_language_of_replies_before_its_first_observation() -> None:
    heavy = {"cryptography", "httpx", "khala_bridge", "khala_protocol.speech", "mcap", "numpy", "pysc2", "scipy"}
    assert imported(f"import khala_sc2.cli, khala_agents.commands\n{SHOW}") & heavy == set()


def test_a_host_imports_no_client_of_models_and_nothing_that_draws_or_meets_guests() -> None:
    heavy = {"aiohttp", "cryptography", "httpx", "khala_bridge.game.guest", "pysc2.lib.video_writer", "scipy"}
    assert imported(f"import khala_sc2.playing.local, khala_sc2.playing.matches\n{SHOW}") & heavy == set()
