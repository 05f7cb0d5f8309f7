"""Rows → files: for each form a folder with a file for each split, made when its first row comes."""

from __future__ import annotations

import json
from contextlib import ExitStack, closing
from enum import StrEnum
from io import TextIOWrapper
from typing import TYPE_CHECKING, Any, Protocol, Self

from khala_protocol.errors import RecordingError
from khala_protocol.extras import needs
from khala_protocol.files import MB, make_private, open_private, write_private
from khala_sc2.dataset import forms

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from khala_sc2.dataset.row import Row

ROW_GROUP_BYTES = 16 * MB
"""Rows are written to Parquet when they have so many bytes; a reader needs as much memory."""
ROW_GROUP_ROWS = 1000


class RowForm(StrEnum):
    """A form of rows: a folder of a data set."""

    PARQUET = "parquet"
    OPENAI = "openai"
    SHAREGPT = "sharegpt"
    TRL = "trl"

    @property
    def suffix(self) -> str:
        """The end of the names of its files."""
        return "parquet" if self in PARQUET_FORMS else "jsonl"


PARQUET_FORMS = frozenset({RowForm.PARQUET, RowForm.TRL})


class Writer(Protocol):
    """What writes the rows of one split."""

    def write(self, row: Row) -> None:
        """Write a row."""
        ...

    def close(self) -> None:
        """End the file."""
        ...


class Files:
    """The files of a data set. A context manager.

    Args:
        directory: of the data set.
        formats: each form once.
        images: whether it has pictures.
        dynamics: whether its rows are of `khala_sc2.dataset.dynamics`.
    """

    def __init__(self, directory: Path, formats: tuple[RowForm, ...], *, images: bool, dynamics: bool = False) -> None:
        self._directory, self._formats, self._images = directory, formats, images
        self._new_writer = _WRITERS | ({RowForm.PARQUET: DynamicsParquet} if dynamics else {})
        self._writers: dict[tuple[RowForm, str], Writer] = {}
        self._stack = ExitStack()
        if PARQUET_FORMS & set(formats):
            import_pyarrow()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._stack.close()

    def write(self, split: str, row: Row) -> None:
        """Write a row in every form."""
        for form in self._formats:
            writer = self._writers.get((form, split))
            if writer is None:
                path = self._directory / form / f"{split}.{form.suffix}"
                make_private(path.parent)
                writer = self._writers[form, split] = self._new_writer[form](path, self._images)
                self._stack.callback(writer.close)
            writer.write(row)


class OpenAI:
    """Chats in OpenAI's form, one a line; pictures stand in them as data URLs."""

    def __init__(self, path: Path, images: bool) -> None:
        self._file = TextIOWrapper(open_private(path, "xb"), encoding="utf-8", newline="\n")
        self._images = images

    def write(self, row: Row) -> None:
        """Write a row."""
        self._file.write(json.dumps(forms.openai(row, images=self._images)) + "\n")

    def close(self) -> None:
        """End the file."""
        self._file.close()


class ShareGPT:
    """Chats in ShareGPT's form, one a line; each picture is a file of its own, written once."""

    def __init__(self, path: Path, images: bool) -> None:
        self._file = TextIOWrapper(open_private(path, "xb"), encoding="utf-8", newline="\n")
        self._images = images
        self._pictures = path.with_name("images")
        if images:
            make_private(self._pictures)

    def write(self, row: Row) -> None:
        """Write a row, and its pictures."""
        for picture in row.pictures if self._images else ():
            path = self._pictures / picture.file_name
            if not path.exists():
                write_private(path, picture.data)
        self._file.write(json.dumps(forms.sharegpt(row, images=self._images)) + "\n")

    def close(self) -> None:
        """End the file."""
        self._file.close()


class Parquet:
    """Rows as columns, with the pictures as a column that `datasets` decodes; here: all that is known of each row."""

    def __init__(self, path: Path, images: bool) -> None:
        pa, pq = import_pyarrow()
        self._pa, self._images = pa, images
        columns = self._columns(pa)
        self._schema = pa.schema(columns.items(), metadata=_METADATA if "images" in columns else None)
        self._file = open_private(path, "xb")
        self._writer = pq.ParquetWriter(self._file, self._schema, compression="zstd")
        self._rows: list[dict[str, Any]] = []
        self._bytes = 0

    def write(self, row: Row) -> None:
        """Take a row; rows are written in groups."""
        self._rows.append(self._plain(row))
        self._bytes += sum(len(message.content) for message in row.prompt)
        self._bytes += sum(len(picture.data) for picture in row.pictures)
        if self._bytes > ROW_GROUP_BYTES or len(self._rows) == ROW_GROUP_ROWS:
            self._flush()

    def close(self) -> None:
        """Write the last group, and end the file."""
        with self._file, closing(self._writer):
            self._flush()

    def _columns(self, pa: Any) -> dict[str, Any]:
        return _columns(pa)

    def _plain(self, row: Row) -> dict[str, Any]:
        return _plain(row, images=self._images)

    def _flush(self) -> None:
        rows, self._rows, self._bytes = self._rows, [], 0
        try:
            table = self._pa.Table.from_pylist(rows, schema=self._schema)
        except (OverflowError, ValueError) as error:  # a recording may be anyone's, and hold any number
            raise RecordingError(f"a number in these recordings is too large for Parquet: {error}") from None
        if rows:
            self._writer.write_table(table)


class TRL(Parquet):
    """Prompts and completions as TRL's trainers read them."""

    def _columns(self, pa: Any) -> dict[str, Any]:
        text = pa.string()
        content = pa.list_(pa.struct({"type": text, "text": text})) if self._images else text
        chat = pa.list_(pa.struct({"role": text, "content": content}))
        return {"id": text, "prompt": chat, "completion": chat, **(_picture_column(pa) if self._images else {})}

    def _plain(self, row: Row) -> dict[str, Any]:
        return forms.trl(row, images=self._images) | ({"images": _pictures(row)} if self._images else {})


class DynamicsParquet(Parquet):
    """Observations, joint orders and next observations as columns."""

    def _columns(self, pa: Any) -> dict[str, Any]:
        text = pa.string()
        whole = pa.int64()
        columns = _columns(pa)
        order = pa.struct({"game_loop": whole, "agent": text, "action": text})
        clock = pa.struct({"rule": text, "step_loops": whole, "thinking_loops": whole, "speed": pa.float64()})
        return {name: columns[name] for name in (*_PLACE, "prompt", *_OF_EPISODE)} | {
            "observation": text, "orders": pa.list_(order), "rejected": columns["rejected"], "next_observation": text,
            "next_step": whole, "next_game_loop": whole, "clock": clock, "fog": text, "view": text, "next_view": text,
        }  # fmt: skip

    def _plain(self, row: Row) -> dict[str, Any]:
        following = row.following
        assert following is not None
        plain = _plain(row, images=False)
        return {name: plain[name] for name in (*_PLACE, "prompt", "rejected", *_OF_EPISODE)} | {
            "observation": following.observation,
            "orders": [order._asdict() for order in following.orders],
            "next_observation": row.reply,
            "next_step": following.step,
            "next_game_loop": following.game_loop,
            "clock": following.clock.model_dump(include={"rule", "step_loops", "thinking_loops", "speed"}),
            "fog": following.fog,
            "view": following.view.model_dump_json(),
            "next_view": following.next_view.model_dump_json(),
        }


_PLACE = ("id", "run", "task", "variant", "map", "game", "seed", "side", "agent", "episode", "step", "game_loop")
_OF_EPISODE = ("reward", "outcome", "valid")
_WRITERS: dict[RowForm, Callable[[Path, bool], Writer]] = {
    RowForm.PARQUET: Parquet,
    RowForm.OPENAI: OpenAI,
    RowForm.SHAREGPT: ShareGPT,
    RowForm.TRL: TRL,
}


def import_pyarrow() -> tuple[Any, Any]:
    """Return pyarrow and its module for Parquet.

    Raises:
        NotInstalled: it is not there.
    """
    with needs("data", source="Parquet"):
        import pyarrow  # type: ignore[import-untyped]  # noqa: PLC0415, ICN001  # an extra
        import pyarrow.parquet  # type: ignore[import-untyped]  # noqa: PLC0415
    return pyarrow, pyarrow.parquet


_METADATA = {"huggingface": json.dumps({"info": {"features": {"images": [{"_type": "Image"}]}}})}
"""Of a schema; says to `datasets` that the pictures are some."""


def _picture_column(pa: Any) -> dict[str, Any]:
    return {"images": pa.list_(pa.struct({"bytes": pa.binary(), "path": pa.string()}))}


def _pictures(row: Row) -> list[dict[str, Any]]:
    return [{"bytes": picture.data, "path": picture.file_name} for picture in row.pictures]


def _columns(pa: Any) -> dict[str, Any]:
    text = pa.string()
    whole = pa.int64()
    number = pa.float64()
    return {
        "id": text, "run": text, "task": text, "variant": text, "map": text, "game": text, "seed": whole,
        "side": text, "agent": text, "episode": whole, "step": whole, "game_loop": whole,
        "prompt": pa.list_(pa.struct({"role": text, "content": text})), "prompt_recorded": pa.bool_(),
        **_picture_column(pa), "image_titles": pa.list_(text),
        "reply": text, "status": text, "model": text,
        "accepted": pa.list_(text),
        "rejected": pa.list_(pa.struct({"reason": text, "message": text, "text": text, "team": text})),
        "fate": text, "age_loops": whole,
        "reward": number, "reward_to_go": number, "own_reward": number, "own_reward_to_go": number,
        "prompt_token_ids": pa.list_(whole), "reply_token_ids": pa.list_(whole), "reply_logprobs": pa.list_(number),
        "outcome": text, "valid": pa.bool_(),
        "usage": pa.struct({"requests": whole, "prompt_tokens": whole, "completion_tokens": whole,
                            "cached_tokens": whole, "reasoning_tokens": whole, "cost_usd": number}),
    }  # fmt: skip


def _plain(row: Row, *, images: bool) -> dict[str, Any]:
    same = (
        "id", "run", "task", "variant", "game", "seed", "side", "agent", "episode", "step", "game_loop",
        "prompt_recorded", "reply", "status", "model", "fate", "age_loops", "outcome", "valid",
    )  # fmt: skip
    return {name: getattr(row, name) for name in same} | {
        "map": row.map_name,
        "prompt": [{"role": message.role, "content": message.content} for message in row.prompt],
        "images": _pictures(row) if images else [],
        "image_titles": [picture.ref.title for picture in row.pictures] if images else [],
        "accepted": list(row.accepted),
        "rejected": [
            rejection.model_dump(include={"reason", "message", "text", "team"}) for rejection in row.rejections
        ],
        "reward": row.reward.reward,
        "reward_to_go": row.reward.to_go,
        "own_reward": row.own_reward.reward,
        "own_reward_to_go": row.own_reward.to_go,
        "prompt_token_ids": list(row.tokens.prompt_ids),
        "reply_token_ids": list(row.tokens.reply_ids),
        "reply_logprobs": list(row.tokens.logprobs),
        "usage": row.usage.model_dump(
            include={"requests", "prompt_tokens", "completion_tokens", "cached_tokens", "reasoning_tokens", "cost_usd"}
        ),
    }
