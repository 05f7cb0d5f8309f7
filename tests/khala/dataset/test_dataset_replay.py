"""A match that is played from a data set is the recorded one."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

import pytest

from khala_agents.build import load_policy
from khala_agents.policy import Context, Decision
from khala_protocol.errors import ConfigError
from khala_protocol.messages import Briefing, Observation, Reply
from khala_protocol.trust import trust_named
from khala_sc2.dataset.card import Recipe
from khala_sc2.dataset.export import export
from khala_sc2.dataset.files import RowForm
from khala_sc2.dataset.replay import FromDataset, replies_of

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Mapping
    from pathlib import Path

    from khala_agents.policy import Policy
    from khala_protocol.recording import Recording

    PlayAgain = Callable[[str, Mapping[str, Policy]], Awaitable[Recording]]

pytestmark = pytest.mark.game

NAME = "khala_sc2.dataset.replay:FromDataset"


def both() -> dict[str, Policy]:
    trust_named(NAME)
    return {agent: load_policy(NAME) for agent in ("Stalkers", "Zealots")}


def seen(recording: Recording) -> list[tuple[str, int, str]]:
    return [(one.agent, one.step, one.but(run="").model_dump_json()) for one in recording.of(Observation)]


def check_same(again: Recording, recording: Recording) -> None:
    """Compare what agents saw and said, and how it ended."""
    assert seen(again) == seen(recording)
    said = {(one.agent, one.step): one.text for one in recording.of(Reply)}
    assert {(one.agent, one.step): one.text for one in again.of(Reply)} == said
    (now,), (then,) = again.results, recording.results
    for name in ("outcome", "steps", "game_loop", "killed", "lost", "score", "accepted", "rejections", "statuses"):
        assert getattr(now, name) == getattr(then, name)


@pytest.mark.parametrize(
    "form",
    [
        RowForm.PARQUET,
        pytest.param(RowForm.TRL, marks=pytest.mark.slow),
        pytest.param(RowForm.SHAREGPT, marks=pytest.mark.slow),
        pytest.param(RowForm.OPENAI, marks=pytest.mark.slow),
    ],
)
async def test_a_match_from_a_data_set_ends_as_the_recorded_one(
    recording: Recording,
    data_set: Path,
    play_again: PlayAgain,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    form: RowForm,
) -> None:
    monkeypatch.setenv("KHALA_DATASET", str(data_set / form))
    again = await play_again("again", both())
    assert not [record for record in caplog.records if record.name == "khala_sc2.dataset.replay"]
    check_same(again, recording)


@pytest.mark.parametrize("form", RowForm)
def test_every_form_has_every_reply(recording: Recording, data_set: Path, form: RowForm) -> None:
    replies = replies_of(data_set / form)
    said = {f"first/blue/{one.agent}/0/{one.step}": one.text for one in recording.of(Reply)}
    if form is RowForm.OPENAI:
        assert replies.only_run is None
        assert {reply.text for reply in replies.by_prompt.values()} == set(said.values())
    else:
        assert {place: reply.text for place, reply in replies.by_place.items()} == said


async def test_a_data_set_without_the_worked_example_is_found_by_its_prompts(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    export([recording.path], tmp_path / "out", Recipe((RowForm.OPENAI,), example="none"))
    monkeypatch.setenv("KHALA_DATASET", str(tmp_path / "out"))
    briefing = next(recording.of(Briefing, agent="Stalkers"))
    first = next(recording.observations("Stalkers"))
    said = next(reply.text for reply in recording.of(Reply) if (reply.agent, reply.step) == ("Stalkers", first.step))
    assert await FromDataset().decide(Context(briefing, first)) == said


async def test_what_the_data_set_does_not_have_is_no_decision(
    recording: Recording, data_set: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("KHALA_DATASET", str(data_set))
    later = next(recording.observations("Zealots")).but(step=1000)
    said = await FromDataset().decide(Context(next(recording.of(Briefing)), later))
    assert said == Decision("", "failed", "not in the data set")


async def test_another_game_than_the_recorded_one_is_noticed_once(
    recording: Recording, data_set: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("KHALA_DATASET", str(data_set))
    briefing, policy = next(recording.of(Briefing, agent="Stalkers")), FromDataset()
    first, *others = recording.observations("Stalkers")
    for observation in (first, *(one.but(text="Nothing.") for one in others)):
        await policy.decide(Context(briefing, observation))
    (warning,) = [record.getMessage() for record in caplog.records if record.name == "khala_sc2.dataset.replay"]
    assert warning.startswith("agent Stalkers: from episode 0, step 1 on its prompts are not those of the data set")


def test_what_is_wrong_is_said(data_set: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("KHALA_DATASET", raising=False)
    with pytest.raises(ConfigError, match="KHALA_DATASET: names no data set"):
        FromDataset()
    monkeypatch.setenv("KHALA_DATASET", str(data_set))
    monkeypatch.setenv("KHALA_DATASET_RUN", "second")
    with pytest.raises(ConfigError, match=r"KHALA_DATASET_RUN: .* has no run 'second'"):
        FromDataset()
    (tmp_path / "wrong.jsonl").write_text('{"text": 1}\n')
    for place, why in ((tmp_path / "none", "cannot be read"), (tmp_path / "wrong.jsonl", "is not a file of")):
        with pytest.raises(ConfigError, match=why):
            replies_of(place)
    with pytest.raises(ConfigError, match="two decisions first/blue/"):
        replies_of(_twice(data_set / "sharegpt" / "train.jsonl", tmp_path / "twice"))


def _twice(path: Path, directory: Path) -> Path:
    """Copy a file into a directory twice, with other replies."""
    directory.mkdir()
    shutil.copy(path, directory / "a.jsonl")
    (directory / "b.jsonl").write_text(path.read_text().replace("Analysis:", "Thoughts:"))
    return directory
