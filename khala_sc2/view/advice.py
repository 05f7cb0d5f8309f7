"""Advice from the page to the agents of a running match, sent as `khala advise` sends it."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

from khala_protocol.bus import Delivery
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.codec import encode
from khala_protocol.errors import NoRouter
from khala_protocol.keys import Topic, agent_key
from khala_sc2.commands.advise import FIND_NEAR_S, FIND_S, Adviser, NoMatch, card_of, places

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from khala_protocol.bus import Bus, Publisher
    from khala_protocol.bus.config import BusConfig
    from khala_protocol.messages import Run
    from khala_sc2.view.wire import AdviceNote


@dataclass(frozen=True, slots=True)
class _Line:
    """An open way to the agents of one side."""

    bus: Bus
    publisher: Publisher
    card: Run


class Advisers:
    """The adviser of a view: one link for each run and side, which is opened when it is used first.

    Args:
        name: of the adviser, as the task has it.
        connect: endpoints; none for this machine's own matches.
        tls: directory with keys; None for a link without TLS.
        insecure: allow links to other machines without TLS.
    """

    def __init__(self, name: str, connect: Sequence[str], tls: Path | None, *, insecure: bool) -> None:
        self._name, self._connect, self._tls, self._insecure = name, connect, tls, insecure
        self._lines: dict[tuple[str, str], _Line] = {}

    async def send(self, run: str, note: AdviceNote) -> None:
        """Send advice.

        Raises:
            KhalaError: there is no such match, it has no such adviser, or the text is none for its agents.
        """
        adviser = Adviser(run=run, side=note.side, name=self._name)
        line = self._lines.get((run, note.side))
        if line is None:
            line = self._lines[run, note.side] = await self._open(adviser)
        text = " ".join(note.text.split())
        await line.publisher.put(encode(adviser.advice(f"@{note.recipient} {text}", line.card)))

    async def close(self) -> None:
        """Close all links."""
        while self._lines:
            _, line = self._lines.popitem()
            await line.bus.close()

    async def _open(self, adviser: Adviser) -> _Line:
        *others, last = places(adviser, self._connect, self._tls, insecure=self._insecure)
        for config in others:
            with contextlib.suppress(NoMatch):
                return await self._connect_to(config, adviser, FIND_NEAR_S)
        return await self._connect_to(last, adviser, FIND_S)

    async def _connect_to(self, config: BusConfig, adviser: Adviser, find_s: float) -> _Line:
        try:
            bus = await open_bus(config)
        except NoRouter as error:
            raise NoMatch(f"the match is not here: {error.found}; --connect says where it is") from None
        try:
            card = await card_of(bus, adviser, find_s)
            key = agent_key(adviser.run, adviser.side, adviser.name, Topic.ADVICE)
            return _Line(bus, await bus.publisher(key, Delivery.SPEECH), card)
        except BaseException:
            await bus.close()
            raise
