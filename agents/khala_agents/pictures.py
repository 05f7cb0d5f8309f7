"""The pictures that arrived lately, found by the hash under which observations name them.

A picture travels on its own topic and is sent before the observation that names it, but nothing promises that it
arrives before it, or at all: a policy that wants pictures waits for a moment, and goes on with those it has. Only
`khala_agents.worker` stores pictures; policies find them in their `khala_agents.policy.Context`.
"""

from __future__ import annotations

import asyncio
import hashlib
from collections import OrderedDict
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from khala_protocol.messages import ImageRef

MOST_BYTES = 32 * 2**20
"""Size of the store; older pictures are forgotten. An observation with three pictures has about 100 kB."""
PATIENCE_S = 0.5
"""How long to wait for a missing picture."""


class PictureStore:
    """The newest pictures of one agent."""

    def __init__(self, most_bytes: int = MOST_BYTES) -> None:
        self._most_bytes = most_bytes
        self._bytes = 0
        self._kept: OrderedDict[str, bytes] = OrderedDict()
        self._arrived = asyncio.Condition()

    async def put(self, data: bytes) -> None:
        """Store a picture."""
        digest = hashlib.sha256(data).hexdigest()
        if digest in self._kept:  # the same picture again: it becomes the newest
            self._kept.move_to_end(digest)
        else:
            self._kept[digest] = data
            self._bytes += len(data)
            while self._bytes > self._most_bytes and len(self._kept) > 1:
                _, old = self._kept.popitem(last=False)
                self._bytes -= len(old)
        async with self._arrived:
            self._arrived.notify_all()

    async def get(self, refs: Sequence[ImageRef], within_s: float = PATIENCE_S) -> Mapping[str, bytes]:
        """Return the bytes of these pictures by their hashes, without those that do not arrive within this time."""
        wanted = {ref.sha256 for ref in refs}
        if not wanted <= self._kept.keys():
            try:
                async with asyncio.timeout(within_s), self._arrived:
                    await self._arrived.wait_for(lambda: wanted <= self._kept.keys())
            except TimeoutError:
                pass
        return {digest: self._kept[digest] for digest in sorted(wanted) if digest in self._kept}
