"""Where a run is recorded: next to existing files, never over them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_sc2.playing.matches import new

if TYPE_CHECKING:
    from pathlib import Path

MATCH = {"seed": 1, "episodes": 1, "assemble_s": 60.0}


@pytest.mark.parametrize(
    ("there", "written"),
    [
        ([], "recording.mcap"),
        (["recording.mcap"], "recording-2.mcap"),
        (["recording.mcap", "recording-2.mcap"], "recording-3.mcap"),
        (["recording-2.mcap"], "recording.mcap"),
    ],
)
def test_a_run_begun_anew_gets_a_recording_of_its_own(tmp_path: Path, there: list[str], written: str) -> None:
    (tmp_path / "again").mkdir()
    for name in there:
        (tmp_path / "again" / name).touch()
    config = new("2s3z_pair", "again", tmp_path, **MATCH)
    assert config.record == tmp_path / "again" / written


def test_a_place_that_cannot_be_looked_at_is_the_recorders_to_complain_about(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert new("2s3z_pair", "again", tmp_path / "file", **MATCH).record == tmp_path / "file/again/recording.mcap"
