"""A resumed match keeps its options: which options --resume takes, and which it refuses."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

import pytest
import typer

from khala_bridge.game.game import GameIdentity
from khala_orchestrator.match.cards import run_card
from khala_protocol.codec import encode
from khala_protocol.errors import ConfigError
from khala_protocol.keys import Topic, run_key
from khala_protocol.recording import Recorder
from khala_sc2.cli import app
from khala_sc2.commands.run_options import MatchOptions
from khala_sc2.playing.matches import new, new_or_resumed

if TYPE_CHECKING:
    from pathlib import Path

RECORDED = [field.name for field in fields(MatchOptions) if field.name != "assemble_s"]
UNSAID: dict[str, Any] = dict.fromkeys(RECORDED)
TAKEN = {
    *("resume", "out", "as_json", "game", "assemble_s", "connect", "listen", "tls", "insecure", "trust"),
    *("person", "page_host", "page_port", "page_https"),
    *(
        "model",
        "model_name",
        "base_url",
        "policy",
        "agents",
        "fallback",
        "rethink",
        "answer",
        "blue",
        "red",
        "side_model",
        "budget_usd",
        "latency_s",
    ),
}


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """Return a directory with what is left of a run "lost"."""
    begun: dict[str, Any] = UNSAID | {"seed": 7, "max_steps": 9, "rule": "budget", "thinking_loops": 20}
    config = new("2s3z_pair", "lost", tmp_path, assemble_s=60.0, **begun)
    assert config.record is not None
    card = run_card(config.model_copy(update={"game": "Khala simulator"}), GameIdentity("", "", "", ""))
    with Recorder(config.record) as recorder:
        recorder.write(run_key("lost", Topic.RUN), encode(card))
    return tmp_path


def resume(out: Path, *, task: str | None = None, run: str | None = None, **given: Any) -> Any:
    return new_or_resumed(task, out / "lost", run, out, assemble_s=60.0, **UNSAID | given)


@pytest.mark.parametrize(
    "given",
    [{}, {"task": "2s3z_pair", "run": "lost", "seed": 7, "episodes": 1}, {"max_steps": 9, "rule": "budget"}],
)
def test_options_that_say_the_same_as_the_recording_are_taken(out: Path, given: dict[str, Any]) -> None:
    config, _ = resume(out, **given)
    assert (config.run, config.seed, config.task.max_steps, config.task.clock.thinking_loops) == ("lost", 7, 9, 20)


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"task": "2s3z"}, "the task 2s3z"),
        ({"run": "other"}, "--run other"),
        ({"seed": 1, "max_steps": 9, "episodes": 2}, "--seed 1, --episodes 2"),
        ({"rule": "realtime", "speed": 2.0}, "--clock realtime, --speed 2.0"),
        ({"images": "screen"}, "--images screen"),
        ({"executor": "screen", "grace_s": 1.0}, "--executor screen, --grace 1.0"),
    ],
)
def test_options_that_say_something_else_are_refused_by_name(out: Path, given: dict[str, Any], named: str) -> None:
    with pytest.raises(ConfigError) as caught:
        resume(out, **given)
    words = f"a resumed match keeps its options: leave out {named}, or begin a new one"
    assert str(caught.value) == words


def test_a_service_goes_on_with_a_match_as_it_was_begun(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("khala_sc2.service.commands.ask", lambda *_: pytest.fail("nothing should be asked"))
    with pytest.raises(ConfigError, match=r"leave out the task 2s3z, --seed 3, or begin a new one"):
        app(["submit", "2s3z", "--resume", "lost", "--run", "lost", "--seed", "3"], standalone_mode=False)


def test_of_every_option_it_is_decided_whether_a_resumed_match_takes_it() -> None:
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]  # it is a group
    for name in ("run", "host", "submit"):
        options = {param.name for param in commands[name].params} - {"task", "run"}
        assert options >= set(RECORDED)
        assert options - set(RECORDED) <= TAKEN | {"help"}
