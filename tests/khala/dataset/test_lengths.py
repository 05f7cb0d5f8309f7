"""The card says how long rows are, field by field, by the tokenizer that was asked for."""

from __future__ import annotations

import sys
from statistics import median
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from khala_protocol.errors import ConfigError
from khala_protocol.messages import ChatMessage
from khala_sc2.dataset.card import Recipe
from khala_sc2.dataset.export import export
from khala_sc2.dataset.files import RowForm
from khala_sc2.dataset.lengths import ESTIMATE, Lengths, TokenCounter, token_counter
from khala_sc2.dataset.rows import Rows

if TYPE_CHECKING:
    from pathlib import Path

    from khala_protocol.recording import Recording
    from khala_sc2.dataset.row import Row


@pytest.mark.game
def test_lengths_are_those_of_the_parts_of_prompts_and_of_replies(recording: Recording, tmp_path: Path) -> None:
    assert recording.run is not None
    rows = list(Rows(recording, recording.run))
    contents = export([recording.path], tmp_path / "out", Recipe((RowForm.OPENAI,)))
    fields = contents.lengths.fields()
    assert list(fields) == ["system", "example", "observation", "reply", "row"]
    replies = [token_counter(None).count(row.reply) for row in rows]
    assert fields["reply"].longest == max(replies)
    assert abs(fields["reply"].median - median(replies)) <= 1
    assert fields["example"].longest == max(
        sum(token_counter(None).count(message.content) for message in row.prompt[1:3]) for row in rows
    )
    assert sum(lengths.share for name, lengths in fields.items() if name != "row") == pytest.approx(1)
    words = (tmp_path / "out" / "openai" / "README.md").read_text()
    assert f"Tokens, {ESTIMATE}" in words
    assert f"| reply | {fields['reply'].median} | {fields['reply'].p95} | {max(replies)} |" in words
    assert f"must keep more than {fields['row'].longest} tokens" in words


def row_of(*contents: str, example: int, reply: str) -> Row:
    """Return a row whose prompt has these texts."""
    roles = ("system", *("user", "assistant") * len(contents))
    prompt = tuple(ChatMessage(role=role, content=content) for role, content in zip(roles, contents, strict=False))
    row: Any = SimpleNamespace(prompt=prompt, example=example, reply=reply)
    return row  # type: ignore[no-any-return]


def test_each_message_belongs_to_one_field_and_fields_that_no_row_has_are_left_out() -> None:
    lengths = Lengths(TokenCounter("characters", len))
    lengths.add(row_of("s" * 10, "e", "ee", "m" * 3, "m" * 4, "o" * 20, example=2, reply="r" * 10))
    lengths.add(row_of("s" * 10, "o" * 30, example=0, reply="r" * 10))
    assert lengths.fields() == {
        "system": (10, 10, 10, 0.2),
        "example": (0, 3, 3, 0.03),
        "earlier steps": (0, 7, 7, 0.07),
        "observation": (20, 30, 30, 0.5),
        "reply": (10, 10, 10, 0.2),
        "row": (50, 50, 50, 1.0),
    }
    alone = Lengths(TokenCounter("characters", len))
    alone.add(row_of("o" * 30, example=0, reply="r" * 10))
    assert list(alone.fields()) == ["observation", "reply", "row"]


def test_median_and_95_per_cent_are_lengths_that_rows_have() -> None:
    lengths = Lengths(TokenCounter("characters", len))
    for number in range(1, 101):
        lengths.add(row_of("o", example=0, reply="r" * number))
    assert lengths.fields()["reply"][:3] == (50, 95, 100)


def test_a_tokenizer_of_a_file_counts_without_special_tokens(tmp_path: Path) -> None:
    tokenizers = pytest.importorskip("tokenizers")
    words = tokenizers.Tokenizer(tokenizers.models.WordLevel({"?": 0, "[s]": 1}, unk_token="?"))
    words.pre_tokenizer = tokenizers.pre_tokenizers.Whitespace()
    words.post_processor = tokenizers.processors.TemplateProcessing("[s] $0", special_tokens=[("[s]", 1)])
    words.save(str(tmp_path / "tokenizer.json"))
    counter = token_counter(str(tmp_path / "tokenizer.json"))
    assert (counter.name, counter.count("one two three")) == ("counted by tokenizer.json", 3)


def test_tiktoken_counts_a_marker_of_its_own_as_text(monkeypatch: pytest.MonkeyPatch) -> None:
    tiktoken = pytest.importorskip("tiktoken")
    ranks = {bytes([byte]): byte for byte in range(256)}
    encoding = tiktoken.Encoding("bytes", pat_str=".", mergeable_ranks=ranks, special_tokens={"<|endoftext|>": 256})
    monkeypatch.setattr(tiktoken, "get_encoding", {"bytes": encoding}.__getitem__)
    assert token_counter("tiktoken:bytes").count("<|endoftext|>") == 13
    with pytest.raises(ConfigError, match=r"--tokenizer: 'tiktoken:none' cannot be loaded, encodings are"):
        token_counter("tiktoken:none")


@pytest.mark.parametrize(
    ("name", "package", "wanted"),
    [("tokenizer.json", "tokenizers", r'"khala\[data\]"'), ("tiktoken:o200k_base", "tiktoken", "tiktoken")],
)
def test_a_package_that_is_missing_is_named(
    monkeypatch: pytest.MonkeyPatch, name: str, package: str, wanted: str
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ConfigError, match=rf"--tokenizer: needs the package {package}, .* pip install {wanted}\."):
        token_counter(name)


def test_a_file_that_is_no_tokenizer_is_said_before_anything_is_written(tmp_path: Path) -> None:
    pytest.importorskip("tokenizers")
    (tmp_path / "tokenizer.json").write_text("{}")
    with pytest.raises(ConfigError, match=r"cannot be loaded, it is no tokenizer\.json"):
        export([tmp_path], tmp_path / "out", Recipe(tokenizer=str(tmp_path / "tokenizer.json")))
    assert not (tmp_path / "out").exists()
