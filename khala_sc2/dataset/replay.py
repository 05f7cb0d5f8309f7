"""A policy that gives the replies of a data set, for `khala run TASK --policy khala_sc2.dataset.replay:FromDataset`.

    KHALA_DATASET       the directory that `khala dataset export` wrote, or one file of it
    KHALA_DATASET_RUN   the run to play from; needed where the data set has several, and the match has another name

A reply is looked up by run, side, agent, episode and step. Without a run, and in OpenAI's form, which does not say of
which run a chat is, it is looked up by the prompt: that of the same briefing and observation, word for word. A decision
that the data set does not have is not made.
"""

from __future__ import annotations

import logging
import os
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from khala_agents.policy import Decision, Policy
from khala_protocol.errors import ConfigError
from khala_sc2.dataset.files import RowForm
from khala_sc2.dataset.prompts import Prompter, count_example, without_example
from khala_sc2.dataset.read import read_rows
from khala_sc2.dataset.repeats import chat_digest, prompt_digest

if TYPE_CHECKING:
    from khala_agents.policy import Context, Said
    from khala_protocol.messages import Briefing, Observation
    from khala_sc2.dataset.read import WrittenRow

log = logging.getLogger(__name__)

PATH, RUN = "KHALA_DATASET", "KHALA_DATASET_RUN"
_FORMS = (RowForm.PARQUET, RowForm.TRL, RowForm.SHAREGPT, RowForm.OPENAI)
"""Folders of a data set, the one that knows most first."""


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
        prompts = self._digests(context.briefing, seen)
        found = self._look_up(seen, prompts)
        if found is None:
            return Decision("", "failed", "not in the data set")
        if found.prompt not in prompts and not self._warned:
            self._warned = True
            log.warning(
                "agent %s: from episode %d, step %d on its prompts are not those of the data set: the match has gone "
                "another way, or they had a summary or a memory of the agent's own",
                seen.agent, seen.episode, seen.step,
            )  # fmt: skip
        self._prompter.remember(seen, found.text)
        return found.text

    def _digests(self, briefing: Briefing, seen: Observation) -> tuple[bytes, bytes]:
        """Return the digests of the prompt with its worked example and without: a data set has the one or the other."""
        prompt = self._prompter.messages(briefing, seen)
        bare = without_example(prompt, count_example(prompt, self._prompter.example))
        return chat_digest(prompt), chat_digest(bare)

    def _look_up(self, seen: Observation, prompts: tuple[bytes, ...]) -> _Reply | None:
        run = seen.run if seen.run in self._replies.runs else self._run
        by_place = self._replies.by_place.get(f"{run}/{seen.side}/{seen.agent}/{seen.episode}/{seen.step}")
        return by_place or next(filter(None, map(self._replies.by_prompt.get, prompts)), None)


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

    def add(self, row: WrittenRow) -> None:
        """Take a row.

        Raises:
            ConfigError: there is another reply to the same place.
        """
        reply = _Reply(row.reply, prompt_digest(row.prompt))
        self.by_prompt.setdefault(reply.prompt, reply)
        if row.place is not None:
            if self.by_place.setdefault(row.place, reply) != reply:
                raise ConfigError(f"the data set has two decisions {row.place}: two of its recordings have this run")
            self.runs.add(row.place.partition("/")[0])


@cache
def replies_of(path: Path) -> Replies:
    """Return the replies of a data set, read once in a process.

    Raises:
        ConfigError: there is none, or it cannot be read.
    """
    replies = Replies()
    try:
        for file in _files(path):
            for row in read_rows(file):
                replies.add(row)
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
