"""A view as one file: the same answers by the same paths, which nothing in them can break out of."""

from __future__ import annotations

import base64
import gzip
import html
import json
import re
import stat
from typing import TYPE_CHECKING, Any

import pytest

from khala_orchestrator.past.transcript import StepSelection
from khala_protocol.errors import ConfigError
from khala_sc2.view import export as exporting
from khala_sc2.view.export import TooLarge, export
from khala_sc2.view.guard import policy_of
from khala_sc2.view.library import run_id
from khala_sc2.view.sources import Sources
from tests.khala.view.made import AGENT, HOSTILE, STEPS, make, opened

if TYPE_CHECKING:
    from pathlib import Path

PAGE = "<!doctype html><html><head><title>khala</title><script>go()</script></head><body></body></html>"


def write(tmp_path: Path, *names: str, **options: Any) -> tuple[str, dict[str, Any]]:
    """Return the file of an export, and the answers in it."""
    paths = [make(tmp_path / f"{name}.mcap") for name in names or ("made",)]
    out = tmp_path / "out.html"
    whole: dict[str, Any] = {"steps": StepSelection(), "agents": ()} | options
    assert export(Sources("made", None, paths), PAGE, out, **whole) == out.stat().st_size
    text = out.read_text()
    found = re.search(r'<script type="application/json" id="khala-data">([A-Za-z0-9+/=]+)</script>', text)
    assert found is not None
    return text, json.loads(gzip.decompress(base64.b64decode(found[1])))


def test_it_has_the_answers_of_the_server(tmp_path: Path) -> None:
    _, answers = write(tmp_path)
    path = tmp_path / "made.mcap"
    run, server = f"runs/{run_id(path)}", opened(path)
    assert answers["library"]["opened"] == [run_id(path)]
    assert answers[f"{run}/episodes/0/timeline"] == json.loads(server.timeline(0))
    assert answers[f"{run}/episodes/0/terrain"] == json.loads(server.terrain(0))
    assert answers[f"{run}/episodes/0/scenes?from=16&to=31"] == json.loads(server.scenes(0, 16, 31))
    for step in (0, STEPS - 1):
        assert answers[f"{run}/episodes/0/steps/{step}"] == json.loads(server.moment(0, step))
        asked = json.loads(server.texts(0, step, "blue", AGENT))
        assert answers[f"{run}/episodes/0/steps/{step}/agents/blue/{AGENT}"] == asked
    (picture,) = (answer for name, answer in answers.items() if "/images/" in name)
    assert picture.startswith("data:image/png;base64,")


@pytest.mark.parametrize("before", [None, 0o644])
def test_its_user_alone_reads_it(tmp_path: Path, before: int | None) -> None:
    out = tmp_path / "out.html"
    if before is not None:
        out.touch()
        out.chmod(before)
    write(tmp_path)
    assert stat.S_IMODE(out.stat().st_mode) == 0o600


def test_two_runs_are_in_one_file(tmp_path: Path) -> None:
    _, answers = write(tmp_path, "a", "b")
    assert len(answers["library"]["opened"]) == 2
    assert sum(name.endswith("/timeline") for name in answers) == 2


def test_a_hostile_text_is_data_in_it(tmp_path: Path) -> None:
    text, answers = write(tmp_path)
    assert HOSTILE not in text
    assert HOSTILE in json.dumps(answers).replace('\\"', '"')
    assert text.count("<script") == 2


def test_its_policy_lets_it_ask_nobody(tmp_path: Path) -> None:
    text, _ = write(tmp_path)
    found = re.search(r'<head><meta http-equiv="Content-Security-Policy" content="([^"]+)">', text)
    assert found is not None
    policy = html.unescape(found[1])
    assert "connect-src 'none'" in policy
    assert policy.split("script-src ")[1].split(";")[0] == policy_of(PAGE).split("script-src ")[1].split(";")[0]


def test_a_part_is_written_without_the_rest(tmp_path: Path) -> None:
    _, answers = write(tmp_path, steps=StepSelection(first=10, last=20), agents=("Nobody",))
    steps = [int(name.rsplit("/", 1)[1]) for name in answers if re.search(r"/steps/\d+$", name)]
    assert steps == list(range(10, 21))
    assert not any("/agents/" in name for name in answers)


def test_too_much_for_one_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exporting, "MOST_BYTES", 1000)
    with pytest.raises(TooLarge, match="--steps"):
        write(tmp_path)


def test_a_page_that_is_not_built_and_a_directory_are_no_exports(tmp_path: Path) -> None:
    whole: dict[str, Any] = {"steps": StepSelection(), "agents": ()}
    with pytest.raises(ConfigError, match="make page"):
        export(Sources("made", None, [make(tmp_path / "made.mcap")]), "<p>", tmp_path / "out.html", **whole)
    with pytest.raises(ConfigError, match="one recording or two"):
        export(Sources("runs", tmp_path), PAGE, tmp_path / "out.html", **whole)
