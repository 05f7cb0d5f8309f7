"""A policy that gives the replies of a data set, for `khala run TASK --policy khala.dataset.replay:FromDataset`.

    KHALA_DATASET       the directory that `khala dataset export` wrote, or one file of it
    KHALA_DATASET_RUN   the run to play from; needed where the data set has several, and the match has another name

A reply is looked up by run, side, agent, episode and step. Without a run, and in OpenAI's form, which does not say of
which run a chat is, it is looked up by the prompt: that of the same briefing and observation, word for word. A decision
that the data set does not have is not made.
"""

from __future__ import annotations

import json
import logging
import os
from dataclasses import dataclass, field
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from khala.dataset.files import RowForm, import_pyarrow
from khala.dataset.forms import PLACEHOLDER
from khala.dataset.prompts import Prompter
from khala_agents.policy import Decision, Policy
from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from khala_agents.policy import Context, Said
    from khala_protocol.messages import Observation

log = logging.getLogger(__name__)

PATH, RUN = "KHALA_DATASET", "KHALA_DATASET_RUN"
_FORMS = (RowForm.PARQUET, RowForm.SHAREGPT, RowForm.OPENAI)
"""Folders of a data set, the one that knows most first."""
_ROLES = {"system": "system", "human": "user", "gpt": "assistant"}
_PICTURE = f"{PLACEHOLDER}\n"
"""In ShareGPT's form, the end of a picture; the text of a message stands after its pictures."""
_BATCH_ROWS = 256

Chat = list[tuple[str, str]]


class FromDataset(Policy):
    """The policy of one agent; the environment says which data set.

    Raises:
        ConfigError: there is none, or it cannot be read.
    """

    def __init__(self) -> None:
        path = os.environ.get(PATH)
        if not path:
            raise ConfigError(
                "names no data set: set it to the directory that `khala dataset export` wrote", source=PATH
            )
        self._replies = replies_of(Path(path))
        self._run = os.environ.get(RUN) or self._replies.only_run
        self._prompter = Prompter()
        self._warned = False
        if os.environ.get(RUN) and self._run not in self._replies.runs:
            raise ConfigError(f"{path} has no run '{self._run}'", source=RUN)

    async def decide(self, context: Context) -> Said:
        """Return the reply of the data set."""
        seen = context.observation
        prompt = digest((message.role, message.content) for message in self._prompter.messages(context.briefing, seen))
        found = self._look_up(seen, prompt)
        if found is None:
            return Decision("", "failed", "not in the data set")
        if found.prompt != prompt and not self._warned:
            self._warned = True
            log.warning(
                "agent %s: from episode %d, step %d on its prompts are not those of the data set: the match has gone "
                "another way, or they had a summary or a memory of the agent's own",
                seen.agent, seen.episode, seen.step,
            )  # fmt: skip
        self._prompter.remember(seen, found.text)
        return found.text

    def _look_up(self, seen: Observation, prompt: bytes) -> _Reply | None:
        run = seen.run if seen.run in self._replies.runs else self._run
        by_place = self._replies.by_place.get(f"{run}/{seen.side}/{seen.agent}/{seen.episode}/{seen.step}")
        return by_place or self._replies.by_prompt.get(prompt)


class _Reply(NamedTuple):
    text: str
    prompt: bytes
    """Its digest."""


@dataclass(slots=True)
class Replies:
    """The replies of a data set, by their places and by their prompts."""

    by_place: dict[str, _Reply] = field(default_factory=dict)
    by_prompt: dict[bytes, _Reply] = field(default_factory=dict)
    """Of several replies to the same prompt the first."""
    runs: set[str] = field(default_factory=set)

    @property
    def only_run(self) -> str | None:
        """The run that all replies are of; None if there are several."""
        return next(iter(self.runs)) if len(self.runs) == 1 else None

    def add(self, place: str | None, prompt: Chat, text: str) -> None:
        """Take a row.

        Raises:
            ConfigError: there is another reply to the same place.
        """
        reply = _Reply(text, digest(prompt))
        self.by_prompt.setdefault(reply.prompt, reply)
        if place is not None:
            if self.by_place.setdefault(place, reply) != reply:
                raise ConfigError(f"the data set has two decisions {place}: two of its recordings have this run")
            self.runs.add(place.partition("/")[0])


def digest(prompt: Iterable[tuple[str, str]]) -> bytes:
    """Return the hash of a prompt: of the roles and texts of its messages."""
    return sha256(json.dumps(list(prompt)).encode()).digest()


@cache
def replies_of(path: Path) -> Replies:
    """Return the replies of a data set, read once in a process.

    Raises:
        ConfigError: there is none, or it cannot be read.
    """
    replies = Replies()
    try:
        for file in _files(path):
            for place, prompt, text in _parquet(file) if file.suffix == ".parquet" else _json_lines(file):
                replies.add(place, prompt, text)
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror or error}", source=str(path)) from None
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        raise ConfigError(f"is not a file of `khala dataset export`: {error!r}", source=str(path)) from None
    return replies


def _files(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    folders = [path / form for form in _FORMS if (path / form).is_dir()] or [path]
    files = sorted(file for file in folders[0].iterdir() if file.suffix in {".parquet", ".jsonl"})
    if not files:
        raise ConfigError("holds no data set: name a directory that `khala dataset export` wrote", source=str(path))
    return files


def _parquet(path: Path) -> Iterator[tuple[str | None, Chat, str]]:
    _, pq = import_pyarrow()
    file = pq.ParquetFile(path)
    for batch in file.iter_batches(_BATCH_ROWS, columns=["id", "prompt", "reply"]):
        for row in batch.to_pylist():
            yield row["id"], [(message["role"], message["content"]) for message in row["prompt"]], row["reply"]


def _json_lines(path: Path) -> Iterator[tuple[str | None, Chat, str]]:
    with path.open(encoding="utf-8") as file:
        for line in file:
            row = json.loads(line)
            if "messages" in row:
                chat = [(message["role"], _text(message["content"])) for message in row["messages"]]
            else:
                chat = [(_ROLES[said["from"]], said["value"].split(_PICTURE)[-1]) for said in row["conversations"]]
            yield row.get("id"), chat[:-1], chat[-1][1]


def _text(content: str | list[dict[str, Any]]) -> str:
    """Return the text of a message, which stands after its pictures."""
    return content if isinstance(content, str) else str(content[-1]["text"])
