"""Rows and prompts that come more than once, and the split that a prompt of several splits goes to.

The observations of an opening do not depend on the seed, so matches with other seeds begin with the same prompts. A
prompt that seeds (runs, tasks) of several splits have goes to the first of these splits, with all of its rows: then the
others hold only prompts that were not trained on.

Digests stay in memory, some 200 bytes for each row; texts do not.
"""

from __future__ import annotations

import json
from collections import Counter
from hashlib import sha256
from typing import TYPE_CHECKING

from khala_sc2.dataset.forms import break_placeholders

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from khala_protocol.messages import ChatMessage
    from khala_sc2.dataset.choose import Split
    from khala_sc2.dataset.row import Row

_DIGEST_BYTES = 16


def prompt_digest(prompt: Iterable[tuple[str, str]]) -> bytes:
    """Return the digest of a prompt: of the roles and texts of its messages, as every form writes them."""
    return _digest([[role, break_placeholders(text)] for role, text in prompt])


def chat_digest(prompt: Iterable[ChatMessage]) -> bytes:
    """Return the digest of a prompt that is not written yet, without its pictures."""
    return prompt_digest((message.role, message.content) for message in prompt)


class RepeatedRows:
    """The rows that came so far.

    Attributes:
        duplicates: rows whose prompt, with its pictures, and reply came before.
    """

    def __init__(self) -> None:
        self.duplicates = 0
        self._rows: set[bytes] = set()
        self._replies: Counter[bytes] = Counter()

    def add(self, row: Row) -> bool:
        """Count a row, and return whether it is a duplicate."""
        prompt = chat_digest(row.prompt) + _digest([picture.ref.sha256 for picture in row.pictures])
        key = _digest([prompt.hex(), row.reply])
        if key in self._rows:
            self.duplicates += 1
            return True
        self._rows.add(key)
        self._replies[prompt] += 1
        return False

    @property
    def prompts(self) -> int:
        """The number of different prompts."""
        return len(self._replies)

    @property
    def ambiguous(self) -> int:
        """The number of prompts that have several different replies."""
        return sum(count > 1 for count in self._replies.values())


def find_shared_prompts(rows: Iterable[Row], split: Split) -> Mapping[bytes, str]:
    """Return the prompts that rows of several splits have, by their digests, and the first of these splits.

    Args:
        rows: all rows that are exported.
        split: which part each row belongs to by its seed (run, task).
    """
    first: dict[bytes, int] = {}
    shared: set[bytes] = set()
    for row in rows:
        digest = chat_digest(row.prompt)
        part = split.names.index(split.part(row))
        if first.setdefault(digest, part) != part:
            shared.add(digest)
            first[digest] = min(first[digest], part)
    return {digest: split.names[first[digest]] for digest in shared}


def _digest(value: object) -> bytes:
    return sha256(json.dumps(value).encode()).digest()[:_DIGEST_BYTES]
