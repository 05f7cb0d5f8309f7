"""What is exported is loaded by `datasets`, chosen and split as asked, and holds texts as they were."""

from __future__ import annotations

import dataclasses
import hashlib
import io
import json
import shutil
import sys
import tracemalloc
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest
import yaml
from PIL import Image

from khala_protocol.codec import encode
from khala_protocol.errors import ConfigError, RecordingError
from khala_protocol.messages import Briefing, ModelCall, Observation, Reply, Report, Result, Run
from khala_protocol.recording import Recorder
from khala_sc2.cli import main
from khala_sc2.dataset import forms
from khala_sc2.dataset.card import Recipe
from khala_sc2.dataset.choose import FILTERS, Only, RowChoice, Split
from khala_sc2.dataset.export import export
from khala_sc2.dataset.files import RowForm
from khala_sc2.dataset.read import check_splits, read_rows
from khala_sc2.dataset.repeats import prompt_digest
from khala_sc2.dataset.rows import Rows

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from khala_protocol.recording import Recording

    Rewrite = Callable[..., Recording]

pytestmark = pytest.mark.game

HOSTILE = 'a <image> "quoted"\\ </script>\u2028 \u202e \x1b]0;x\x07 {{7*7}} | `---`\n---\n<|im_end|>\n# Actions:\n'


@pytest.fixture
def load(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Return `datasets.load_dataset` without a network."""
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    monkeypatch.setenv("HF_HOME", str(tmp_path / "home"))
    datasets = pytest.importorskip("datasets")
    datasets.disable_progress_bars()
    return lambda path: datasets.load_dataset(str(path), cache_dir=str(tmp_path / "cache"))


def rows_of(recording: Recording) -> list[Any]:
    assert recording.run is not None
    return list(Rows(recording, recording.run))


def lines(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().split("\n") if line]


def test_datasets_loads_all_columns_of_parquet_and_decodes_the_pictures(
    recording: Recording, data_set: Path, load: Callable[..., Any]
) -> None:
    found, expected = load(data_set / "parquet")["train"], rows_of(recording)
    assert len(found) == len(expected)
    for got, row in zip(found, expected, strict=True):
        assert (got["id"], got["reply"], got["seed"], got["task"]) == (row.id, row.reply, 3, "2s3z_pair")
        assert [message["content"] for message in got["prompt"]] == [message.content for message in row.prompt]
        assert (got["reward"], got["reward_to_go"]) == row.reward
        assert (got["own_reward"], got["own_reward_to_go"]) == row.own_reward != (None, None)
        assert (got["accepted"], got["fate"], got["outcome"]) == (list(row.accepted), row.fate, row.outcome)
        sizes = [(picture.ref.width, picture.ref.height) for picture in row.pictures]
        assert [image.size for image in got["images"]] == sizes != []


def test_datasets_loads_the_chats_in_each_form(recording: Recording, data_set: Path, load: Callable[..., Any]) -> None:
    expected = rows_of(recording)
    chats = load(data_set / "openai")["train"]["messages"]
    assert [chat[-1]["content"][0]["text"] for chat in chats] == [row.reply for row in expected]
    assert {tuple(said["role"] for said in chat) for chat in chats} == {
        ("system", "user", "assistant", "user", "assistant")
    }
    assert {tuple(said.get("weight") for said in chat) for chat in chats} == {(None, None, 0, None, 1)}
    found = load(data_set / "sharegpt")["train"]
    assert found["id"] == [row.id for row in expected]
    said = [{"from": "gpt", "value": row.reply, "weight": 1} for row in expected]
    assert [chat[-1] for chat in found["conversations"]] == said
    assert {tuple(said.get("weight") for said in chat) for chat in found["conversations"]} == {(None, None, 0, None, 1)}
    found = load(data_set / "trl")["train"]
    assert found["id"] == [row.id for row in expected]
    for got, row in zip(found, expected, strict=True):
        assert got["completion"] == [{"role": "assistant", "content": [{"type": "text", "text": row.reply}]}]
        assert [message["role"] for message in got["prompt"]] == [message.role for message in row.prompt]
        kinds = [part["type"] for part in got["prompt"][-1]["content"]]
        assert kinds == ["text", "image"] * len(row.pictures) + ["text"]
        assert len(got["images"]) == len(row.pictures) > 0


def test_datasets_does_not_take_one_export_for_another(
    recording: Recording, tmp_path: Path, load: Callable[..., Any]
) -> None:
    """Its cache knows local data sets by the names of their folders and files, and by what their README says."""
    for agent in ("Stalkers", "Zealots"):
        export([recording.path], tmp_path / agent, Recipe((RowForm.PARQUET,), RowChoice(agents=(agent,))))
        assert set(load(tmp_path / agent / "parquet")["train"]["agent"]) == {agent}


def test_pictures_are_those_that_the_model_was_sent_byte_for_byte(recording: Recording, data_set: Path) -> None:
    sent = {digest[:32] for digest, _ in recording.images()}
    for chat, row in zip(lines(data_set / "sharegpt" / "train.jsonl"), rows_of(recording), strict=True):
        assert chat["images"]
        for name, picture in zip(chat["images"], row.pictures, strict=True):
            data = (data_set / "sharegpt" / name).read_bytes()
            assert hashlib.sha256(data).hexdigest() == picture.ref.sha256
            assert Image.open(io.BytesIO(data)).size == (picture.ref.width, picture.ref.height)
        assert chat["conversations"][-2]["value"].count("<image>") == len(chat["images"])
    assert {path.stem for path in (data_set / "sharegpt" / "images").iterdir()} == sent


def test_without_pictures_a_chat_is_plain_text(recording: Recording, tmp_path: Path, load: Callable[..., Any]) -> None:
    export([recording.path], tmp_path / "out", Recipe((RowForm.OPENAI, RowForm.TRL), images=False))
    completions = load(tmp_path / "out" / "trl")["train"]
    chats = lines(tmp_path / "out" / "openai" / "train.jsonl")
    for chat, completion, row in zip(chats, completions, rows_of(recording), strict=True):
        plain = [{"role": message.role, "content": message.content} for message in row.prompt]
        said = {"role": "assistant", "content": row.reply}
        assert completion == {"id": row.id, "prompt": plain, "completion": [said]}
        plain[2] |= {"weight": 0}
        assert chat == {"messages": [*plain, said | {"weight": 1}]}


@pytest.fixture
def hostile(rewritten: Rewrite) -> Recording:
    """Return the battle of a hostile model, played on a task with a hostile name."""

    def change(sample: Any) -> list[Any]:
        match sample.message:
            case Reply():
                return [sample.message.but(text=HOSTILE)]
            case Run():
                return [sample.message.but(task=HOSTILE)]
        return [sample.message]

    return rewritten(change)


def test_hostile_texts_stay_data(hostile: Recording, tmp_path: Path, load: Callable[..., Any]) -> None:
    export([hostile.path], tmp_path / "out", Recipe())
    assert set(load(tmp_path / "out" / "parquet")["train"]["reply"]) == {HOSTILE}
    chats = lines(tmp_path / "out" / "openai" / "train.jsonl")
    assert {chat["messages"][-1]["content"][0]["text"] for chat in chats} == {HOSTILE}
    for chat in lines(tmp_path / "out" / "sharegpt" / "train.jsonl"):
        placeholders = sum(said["value"].count("<image>") for said in chat["conversations"])
        assert placeholders == len(chat["images"])
        assert chat["conversations"][-1]["value"] == HOSTILE.replace("<image>", "< image>")


def test_a_hostile_name_changes_nothing_of_the_card(hostile: Recording, tmp_path: Path) -> None:
    export([hostile.path], tmp_path / "out", Recipe())
    _, front, words = (tmp_path / "out" / "parquet" / "README.md").read_text().split("---\n", 2)
    assert yaml.safe_load(front)["configs"][0]["config_name"] == "default"
    (line,) = [line for line in words.splitlines() if "quoted" in line]
    assert line.count("|") == 5
    assert "<" not in line
    assert "\x1b" not in line


def test_a_number_that_parquet_cannot_hold_is_said(rewritten: Rewrite, tmp_path: Path) -> None:
    def change(sample: Any) -> list[Any]:
        return [sample.message.but(seed=10**30)] if isinstance(sample.message, Run) else [sample.message]

    with pytest.raises(RecordingError, match="a number in these recordings is too large for Parquet"):
        export([rewritten(change).path], tmp_path / "out", Recipe((RowForm.PARQUET,)))


def test_the_card_says_what_is_in_it(data_set: Path, recording: Recording) -> None:
    _, front, words = (data_set / "parquet" / "README.md").read_text().split("---\n", 2)
    found = yaml.safe_load(front)
    assert found["license"] == "other"
    assert found["size_categories"] == ["n<1K"]
    assert "image-text-to-text" in found["task_categories"]
    assert found["configs"][0]["data_files"] == [{"split": "train", "path": "train.parquet"}]
    rows = rows_of(recording)
    for said in (
        f"| train | {len(rows)} | 3 |",
        f"| 2s3z_pair | files | 2s3z | {len(rows)} |",
        f"| focus-fire | {sum(row.model == 'focus-fire' for row in rows)} |",
        "Khala simulator 0.1.0",
        "0.99 · `reward_to_go`",
        "The terms of commercial models may forbid to train",
    ):
        assert said in words


def test_rows_and_the_card_name_the_variant_of_the_task(rewritten: Rewrite, tmp_path: Path) -> None:
    pq = pytest.importorskip("pyarrow.parquet")

    def change(sample: Any) -> list[Any]:
        return [sample.message.but(variant="paper")] if isinstance(sample.message, Run) else [sample.message]

    papers = rewritten(change)
    export([papers.path], tmp_path / "decisions", Recipe((RowForm.PARQUET, RowForm.SHAREGPT)))
    export([papers.path], tmp_path / "dynamics", Recipe((RowForm.PARQUET,), horizon_s=1.0))
    found = [chat["variant"] for chat in lines(tmp_path / "decisions" / "sharegpt" / "train.jsonl")]
    for name in ("decisions", "dynamics"):
        found += pq.read_table(tmp_path / name / "parquet" / "train.parquet")["variant"].to_pylist()
    assert set(found) == {"paper"}
    words = (tmp_path / "decisions" / "sharegpt" / "README.md").read_text()
    assert f"| 2s3z_pair | paper | 2s3z | {len(rows_of(papers))} |" in words


def test_each_filter_leaves_what_it_names(recording: Recording, tmp_path: Path) -> None:
    rows = rows_of(recording)
    accepted = [row for row in rows if row.accepted and not row.rejections and row.agent == "Zealots"]
    contents = export(
        [recording.path],
        tmp_path / "out",
        Recipe((RowForm.SHAREGPT,), RowChoice((Only.ACCEPTED, Only.OK), ("blue/Zealots",))),
    )
    found = lines(tmp_path / "out" / "sharegpt" / "train.jsonl")
    assert [chat["id"] for chat in found] == [row.id for row in accepted] != []
    assert contents.left_out["another agent"] == sum(row.agent == "Stalkers" for row in rows)
    assert contents.left_out["not accepted"] == len(rows) - len(found) - contents.left_out["another agent"]


@pytest.mark.parametrize(
    ("only", "kept", "left_out"),
    [
        (Only.WINS, {"outcome": "win"}, {"outcome": "draw"}),
        (Only.VALID, {"valid": True}, {"valid": False}),
        (Only.ACCEPTED, {"accepted": ("A",), "rejections": ()}, {"accepted": ("A",), "rejections": ("B",)}),
        (Only.ACCEPTED, {"accepted": ("A",), "rejections": ()}, {"accepted": (), "rejections": ()}),
        (Only.OK, {"status": "ok"}, {"status": "fallback"}),
    ],
)
def test_what_a_filter_keeps(only: Only, kept: dict[str, Any], left_out: dict[str, Any]) -> None:
    row: Callable[..., Any] = SimpleNamespace
    assert FILTERS[only](row(**kept))
    assert not FILTERS[only](row(**left_out))


def test_no_seed_is_in_two_splits_and_shares_are_about_as_asked() -> None:
    split = Split.of("0.8,0.1,0.1", "seed")
    row: Callable[..., Any] = SimpleNamespace
    parts = [split.part(row(seed=seed, task="2s3z")) for seed in range(2000)]
    assert parts == [split.part(row(seed=seed, task="3m")) for seed in range(2000)]
    shares = [parts.count(name) / 2000 for name in ("train", "validation", "test")]
    assert shares == pytest.approx([0.8, 0.1, 0.1], abs=0.03)


def test_seeds_of_two_recordings_go_into_their_splits(
    rewritten: Rewrite, tmp_path: Path, load: Callable[..., Any]
) -> None:
    """The seeds 3 and 7 fall into different halves."""

    rewritten(other_game(7), "runs/7.mcap")
    rewritten(lambda sample: [sample.message], "runs/3.mcap")
    recipe = Recipe((RowForm.PARQUET, RowForm.OPENAI), split=Split.of("0.5,0.5", "seed"))
    export([tmp_path / "runs", tmp_path / "runs" / "3.mcap"], tmp_path / "out", recipe)
    found = load(tmp_path / "out" / "parquet")
    seeds = {name: set(found[name]["seed"]) for name in ("train", "test")}
    assert sorted(map(sorted, seeds.values())) == [[3], [7]]
    assert len(found["train"]) == len(found["test"]) == len(load(tmp_path / "out" / "openai")["test"])


def other_game(seed: int, *, from_step: int = 0) -> Callable[[Any], list[Any]]:
    """Return a change of the recording that makes it one of another seed, with other prompts from a step on."""

    def change(sample: Any) -> list[Any]:
        match sample.message:
            case Run() as run:
                return [run.but(seed=seed)]
            case ModelCall() as call if call.step >= from_step:
                last = call.prompt[-1].but(content=f"Another game.\n{call.prompt[-1].content}")
                return [call.but(prompt=(*call.prompt[:-1], last))]
            case Observation() as seen if seen.step >= from_step:
                return [seen.but(text=f"Another game.\n{seen.text}")]
        return [sample.message]

    return change


def test_a_prompt_of_two_splits_goes_to_the_first_of_them_and_the_card_counts_it(
    rewritten: Rewrite, tmp_path: Path
) -> None:
    """The seeds 3 and 7 fall into different halves; their games begin with the same five steps of two agents."""
    rewritten(other_game(7, from_step=5), "runs/7.mcap")
    rewritten(lambda sample: [sample.message], "runs/3.mcap")
    split = Split.of("0.5,0.5", "seed")
    contents = export([tmp_path / "runs"], tmp_path / "out", Recipe(split=split))
    assert (contents.shared, contents.moved) == (10, 10)
    assert contents.rows["train"] == contents.rows["test"] + 20
    for form in RowForm:
        prompts = {
            name: {prompt_digest(row.prompt) for row in read_rows(tmp_path / "out" / form / f"{name}.{form.suffix}")}
            for name in split.names
        }
        assert prompts["train"]
        assert prompts["test"]
        assert not prompts["train"] & prompts["test"]
        words = (tmp_path / "out" / form / "README.md").read_text()
        assert "several splits: 10. All their rows are in the first of these splits, 10 rows of them away" in words


@pytest.mark.parametrize("form", RowForm)
def test_a_prompt_in_two_written_files_is_found(data_set: Path, tmp_path: Path, form: RowForm) -> None:
    folder = tmp_path / form
    shutil.copytree(data_set / form, folder)
    check_splits(tmp_path, [form])
    shutil.copy(folder / f"train.{form.suffix}", folder / f"test.{form.suffix}")
    with pytest.raises(RecordingError, match=rf"{form}: the prompt of .* is in test and train"):
        check_splits(tmp_path, [form])


def test_duplicates_are_counted_and_left_out_if_asked(recording: Recording, rewritten: Rewrite, tmp_path: Path) -> None:
    """The second game has the recorded prompts of the first, and the agent that asked a model answers otherwise."""

    def change(sample: Any) -> list[Any]:
        if isinstance(sample.message, Reply) and sample.message.agent == "Stalkers":
            return [sample.message.but(text="Actions:\n")]
        return [sample.message]

    again = rewritten(change)
    rows = rows_of(recording)
    changed = sum(row.agent == "Stalkers" for row in rows)
    kept = export([recording.path, again.path], tmp_path / "kept", Recipe((RowForm.OPENAI,)))
    assert kept.rows["train"] == 2 * len(rows)
    assert (kept.repeats.duplicates, kept.repeats.ambiguous) == (len(rows) - changed, changed)
    recipe = Recipe((RowForm.OPENAI,), dedupe=True)
    deduped = export([recording.path, again.path], tmp_path / "deduped", recipe)
    assert deduped.rows["train"] == len(rows) + changed
    assert deduped.left_out["duplicate"] == len(rows) - changed
    words = (tmp_path / "deduped" / "openai" / "README.md").read_text()
    assert f"reply came before: {len(rows) - changed}, left out" in words
    assert f"several different replies: {changed}, kept" in words


def test_without_the_worked_example_a_prompt_has_no_reply(recording: Recording, tmp_path: Path) -> None:
    export([recording.path], tmp_path / "out", Recipe((RowForm.OPENAI,), images=False, example="none"))
    for chat, row in zip(lines(tmp_path / "out" / "openai" / "train.jsonl"), rows_of(recording), strict=True):
        system, _, _, seen = row.prompt
        assert chat["messages"] == [
            {"role": "system", "content": system.content},
            {"role": "user", "content": seen.content},
            {"role": "assistant", "content": row.reply, "weight": 1},
        ]
    assert "are not those that agents play with" in (tmp_path / "out" / "openai" / "README.md").read_text()


@pytest.mark.parametrize(("write", "key"), [(forms.openai, "messages"), (forms.sharegpt, "conversations")])
def test_replies_of_earlier_steps_have_no_weight(
    recording: Recording, write: Callable[..., dict[str, Any]], key: str
) -> None:
    """As a memory of whole steps recalls them: each of them is a row of its own."""
    row = rows_of(recording)[0]
    system, seen, said, now = row.prompt
    longer = dataclasses.replace(row, prompt=(system, seen, said, seen, said, now))
    chat = write(longer, images=False)[key]
    assert [message.get("weight") for message in chat] == [None, None, 0, None, 0, None, 1]


@pytest.mark.slow
def test_trl_reads_prompts_and_completions(
    data_set: Path, tmp_path: Path, recording: Recording, load: Callable[..., Any]
) -> None:
    """Needs no torch: pip install --no-deps trl transformers accelerate safetensors regex jinja2 markupsafe."""
    functions = pytest.importorskip("trl.data_utils")
    transformers = pytest.importorskip("transformers")
    tokenizers = pytest.importorskip("tokenizers")
    words = tokenizers.Tokenizer(tokenizers.models.WordLevel({"?": 0}, unk_token="?"))
    tokenizer = transformers.PreTrainedTokenizerFast(tokenizer_object=words)
    tokenizer.chat_template = (
        "{% for said in messages %}[{{ said.role }}]{{ said.content }}{% endfor %}"
        "{% if add_generation_prompt %}[assistant]{% endif %}"
    )
    export([recording.path], tmp_path / "plain", Recipe((RowForm.TRL,), images=False))
    for got, row in zip(load(tmp_path / "plain" / "trl")["train"], rows_of(recording), strict=True):
        assert functions.is_conversational(got)
        assert functions.apply_chat_template(got, tokenizer)["completion"] == row.reply
    for got in load(data_set / "trl")["train"]:
        messages = functions.prepare_multimodal_messages(got["prompt"] + got["completion"], images=got["images"])
        shown = [part["image"] for said in messages for part in said["content"] if part["type"] == "image"]
        assert shown == got["images"] != []


@pytest.mark.parametrize("text", ["", "0.8", "0.8,0.1", "1,0", "0.5,0.6,-0.1", "a,b", "0.25,0.25,0.25,0.25", "nan,1"])
def test_a_wrong_split_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match="is not a split: write one, two or three shares above 0 that sum up to 1"):
        Split.of(text, "seed")


def test_what_stands_in_the_way_is_named(recording: Recording, tmp_path: Path, data_set: Path) -> None:
    with pytest.raises(ConfigError, match="exists already, and is not empty: name another directory"):
        export([recording.path], data_set, Recipe())
    (tmp_path / "none").mkdir()
    with pytest.raises(ConfigError, match=r"holds no recordings \(\*\.mcap\)"):
        export([tmp_path / "none"], tmp_path / "out", Recipe())
    with pytest.raises(RecordingError, match="there is no such file"):
        export([tmp_path / "none.mcap"], tmp_path / "out", Recipe())
    with pytest.raises(ConfigError, match="Not a directory"):
        export([recording.path], recording.path / "out", Recipe())
    with pytest.raises(ConfigError, match=r"no decision is left to export .*another agent: "):
        export([recording.path], tmp_path / "out", Recipe(choice=RowChoice(agents=("Nobody",))))
    assert not (tmp_path / "out").exists()


def test_without_pyarrow_the_extra_is_named(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ConfigError, match=r"^Parquet: pyarrow is not installed; this installs it: "):
        export([recording.path], tmp_path / "out", Recipe((RowForm.PARQUET,)))
    assert export([recording.path], tmp_path / "out", Recipe((RowForm.OPENAI,))).rows["train"]


def test_files_that_are_no_recordings_and_parts_of_lost_games_are_left_out(
    recording: Recording, tmp_path: Path
) -> None:
    (tmp_path / "runs").mkdir()
    whole = recording.path.read_bytes()
    (tmp_path / "runs" / "a.mcap").write_bytes(whole)
    (tmp_path / "runs" / "a.lost-1.mcap").write_bytes(whole)
    (tmp_path / "runs" / "empty.mcap").touch()
    (tmp_path / "runs" / "torn.mcap").write_bytes(whole[: len(whole) * 2 // 3])
    contents = export([tmp_path / "runs"], tmp_path / "out", Recipe((RowForm.OPENAI,)))
    assert (contents.recordings, contents.unread) == (2, 1)
    assert contents.outcomes["unfinished"] > 5
    assert "no recordings of a match: 1." in (tmp_path / "out" / "openai" / "README.md").read_text()


def test_the_command_prints_what_it_wrote(
    recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    with pytest.raises(SystemExit) as ended:
        main(["dataset", "export", str(recording.path), "--out", str(out), "--format", "openai", "--only", "ok",
              "--agent", "Zealots", "--no-images", "--gamma", "1", "--json"])  # fmt: skip
    assert not ended.value.code
    found = json.loads(capsys.readouterr().out)
    rows = lines(out / "openai" / "train.jsonl")
    assert found["rows"] == {"train": len(rows)}
    assert found["left_out"] == {"another agent": len(rows_of(recording)) - len(rows)}
    assert (found["duplicates"], found["prompts"], found["shared_prompts"]) == (0, len(rows), 0)
    assert 0 < found["tokens"]["reply"]["share"] < 0.2
    assert sorted(path.name for path in (out / "openai").iterdir()) == ["README.md", "train.jsonl"]


@pytest.mark.slow
def test_memory_does_not_grow_with_the_recordings(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("khala_sc2.dataset.files.ROW_GROUP_BYTES", 200_000)

    def peak(episodes: int) -> int:
        """Return the most bytes that are in use while so many episodes are exported."""
        with Recorder(tmp_path / f"{episodes}.mcap") as recorder:
            for episode in range(episodes):
                for sample in recording:
                    if isinstance(sample.message, Observation | Reply | ModelCall | Report | Result | Briefing):
                        recorder.write(sample.key, encode(sample.message.but(episode=episode)))
                    elif episode == 0 or sample.message is None:
                        recorder.write(sample.key, sample.payload)
                    if isinstance(sample.message, Report):
                        recorder.flush()
        tracemalloc.start()
        contents = export([recorder.path], tmp_path / f"{episodes}", Recipe(split=Split.of("0.5,0.5", "seed")))
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert contents.rows.total() == episodes * len(rows_of(recording))
        return most

    peak(1)  # imports what is needed
    few = peak(5)
    assert peak(20) < 1.25 * few
