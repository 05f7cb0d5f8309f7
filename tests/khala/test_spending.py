"""The ledger of a match: one file, however often the match is resumed."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from khala_protocol.errors import ConfigError
from khala_sc2.playing.spending import ledger_of, paid_usd

if TYPE_CHECKING:
    from pathlib import Path


def past_of(record: Path, *, forked: bool = False) -> Any:
    """Return a match that was played up to step 3, of which a recording is there."""
    fork = SimpleNamespace(step=3) if forked else None
    recording = SimpleNamespace(path=record, of=lambda *_, **__: (), run=None)
    return SimpleNamespace(config=SimpleNamespace(forked=fork), steps=3, recording=recording)


def test_a_match_that_is_resumed_twice_has_one_budget(tmp_path: Path) -> None:
    first, second, third = (tmp_path / f"recording{end}.mcap" for end in ("", "-2", "-3"))
    ledger_of(first).pay("blue", 0.5)
    ledger_of(second, past_of(first)).pay("blue", 0.25)
    ledger_of(third, past_of(first)).pay("blue", 0.125)
    assert ledger_of(third, past_of(second)).booked_usd("blue") == pytest.approx(0.875)
    assert [paid_usd(record) for record in (first, second, third)] == pytest.approx([0.875] * 3)


def test_a_match_that_is_resumed_elsewhere_keeps_its_ledger(tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    (tmp_path / "elsewhere").mkdir()
    ledger_of(tmp_path / "runs" / "recording.mcap").pay("blue", 0.5)
    after = ledger_of(tmp_path / "elsewhere" / "recording.mcap", past_of(tmp_path / "runs" / "recording.mcap"))
    assert after.booked_usd() == 0.5


def test_a_fork_has_a_budget_of_its_own(tmp_path: Path) -> None:
    ledger_of(tmp_path / "beginning.mcap").pay("blue", 0.5)
    assert ledger_of(tmp_path / "recording.mcap", past_of(tmp_path / "beginning.mcap", forked=True)).booked_usd() == 0.0


@pytest.mark.parametrize("broken", ["empty", "text", "directory"])
def test_a_broken_ledger_is_found_before_the_match_begins(tmp_path: Path, broken: str) -> None:
    path = tmp_path / "recording.ledger"
    if broken == "directory":
        path.mkdir()
    else:
        path.write_text("" if broken == "empty" else "no ledger")
    with pytest.raises(ConfigError, match=r"recording\.ledger: this ledger of what was spent cannot be kept"):
        ledger_of(tmp_path / "recording.mcap")
