"""How `khala run` begins: what is started before the match is known, and what a signal does then."""

from __future__ import annotations

import asyncio
import os
import signal
from pathlib import Path
from typing import Any

import pytest
import typer

from khala_sc2.commands.exit_codes import SIGNALLED
from khala_sc2.commands.run import WantedRun, _game_for, run
from khala_sc2.commands.run_options import MindOptions


def wanted(task: str | None, **match: Any) -> WantedRun:
    given = {"images": None, "opponent": None} | match
    return WantedRun(task, None, None, Path("runs"), "nowhere", given, MindOptions())


def test_a_signal_before_the_match_is_known_ends_it_in_order(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async def imports(*_: object) -> None:
        os.kill(os.getpid(), signal.SIGTERM)
        await asyncio.Event().wait()

    monkeypatch.setattr("khala_sc2.commands.run._play", imports)
    with pytest.raises(typer.Exit) as ended:
        run(wanted("2s3z"), as_json=False)
    assert ended.value.exit_code == SIGNALLED + signal.SIGTERM
    assert "interrupted before the match began" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("task", "match"),
    [
        (None, {}),
        ("simple64_duel", {}),
        ("2s3z", {"images": "screen"}),
        ("2s3z", {"opponent": "guest"}),
    ],
    ids=["resumed", "two sides", "draws", "guest"],
)
def test_no_game_is_started_early_that_the_match_could_not_take(task: str | None, match: dict[str, Any]) -> None:
    with _game_for(wanted(task, **match)) as launched:  # there is no game of this name: starting one would raise
        assert launched is None
