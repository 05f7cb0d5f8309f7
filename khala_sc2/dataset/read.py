"""Files of a data set → the place, the prompt and the reply of each row; and the check that splits share no prompt."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, NamedTuple

from khala_protocol.errors import RecordingError
from khala_sc2.dataset.files import RowForm, import_pyarrow
from khala_sc2.dataset.forms import PLACEHOLDER
from khala_sc2.dataset.repeats import prompt_digest

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

_ROLES = {"system": "system", "human": "user", "gpt": "assistant"}
_PICTURE = f"{PLACEHOLDER}\n"
"""In ShareGPT's form, the end of a picture; the text of a message stands after its pictures."""
_BATCH_ROWS = 32
_REPLIES = ("reply", "completion", "next_observation")
"""Names of the column with what is to be learned: of all that is known, of TRL's form, of dynamics."""

Chat = list[tuple[str, str]]


class WrittenRow(NamedTuple):
    """What a file says of a decision."""

    place: str | None
    """Its id; None in OpenAI's form."""
    prompt: Chat
    """Role and text of each message, without pictures and their titles."""
    reply: str


def read_rows(path: Path) -> Iterator[WrittenRow]:
    """Yield the rows of a file, in any form.

    Raises:
        OSError: it cannot be read.
        ValueError, LookupError, TypeError, AttributeError: it is none of `khala dataset export`.
    """
    yield from _parquet(path) if path.suffix == ".parquet" else _json_lines(path)


def check_splits(directory: Path, forms: Sequence[RowForm]) -> None:
    """Read the files of a data set, and check that no prompt stands in two splits, word for word.

    Raises:
        RecordingError: one does.
    """
    for form in forms:
        splits: dict[bytes, str] = {}
        for path in sorted((directory / form).glob(f"*.{form.suffix}")):
            for row in read_rows(path):
                other = splits.setdefault(prompt_digest(row.prompt), path.stem)
                if other != path.stem:
                    raise RecordingError(
                        f"{form}: the prompt of {row.place or 'a row'} is in {other} and {path.stem}: if a match was "
                        "still recorded, export again when it has ended"
                    )


def _parquet(path: Path) -> Iterator[WrittenRow]:
    _, pq = import_pyarrow()
    file = pq.ParquetFile(path)
    reply = next(name for name in _REPLIES if name in file.schema_arrow.names)
    for batch in file.iter_batches(_BATCH_ROWS, columns=["id", "prompt", reply]):
        for row in batch.to_pylist():
            said = _text(row[reply][0]["content"]) if reply == "completion" else row[reply]
            yield WrittenRow(row["id"], _chat(row["prompt"]), said)


def _json_lines(path: Path) -> Iterator[WrittenRow]:
    with path.open(encoding="utf-8") as file:
        for line in file:
            row = json.loads(line)
            if "messages" in row:
                chat = _chat(row["messages"])
            else:
                chat = [(_ROLES[said["from"]], said["value"].split(_PICTURE)[-1]) for said in row["conversations"]]
            yield WrittenRow(row.get("id"), chat[:-1], chat[-1][1])


def _chat(messages: list[dict[str, Any]]) -> Chat:
    return [(message["role"], _text(message["content"])) for message in messages]


def _text(content: str | list[dict[str, Any]]) -> str:
    """Return the text of a message, which stands after its pictures."""
    return content if isinstance(content, str) else str(content[-1]["text"])
