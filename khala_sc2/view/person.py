"""The work of `khala person`: persons join a run over the bus, each as the agent whose seat it takes."""

from __future__ import annotations

import asyncio
import signal
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

from khala_orchestrator.roster import Seat
from khala_protocol.bus.zenoh import open_bus
from khala_protocol.keys import check_name
from khala_protocol.signals import cancelled_by_signal
from khala_sc2.commands.exit_codes import SIGNALLED
from khala_sc2.playing.persons import PersonSeat, play_seat
from khala_sc2.view.seats import serve_seats

if TYPE_CHECKING:
    from collections.abc import Sequence

    from khala_agents.commands import BusPlace, Link
    from khala_protocol.bus import Bus
    from khala_sc2.view.seats import SeatPlace


def play_persons(names: Sequence[str], run: str, side: str, bus: BusPlace, place: SeatPlace) -> None:
    """Serve a page for each agent until the run is over or a signal comes.

    Args:
        names: of the agents.
        run: name of the run.
        side: of the agents.
        bus: where the run is, and with which certificates agents join it.
        place: where the pages are served.

    Raises:
        KhalaError: the bus cannot be joined so, or the pages cannot be served there.
    """
    check_name(run, "run")
    seats = {name: PersonSeat(Seat(check_name(side, "side"), check_name(name, "agent"))) for name in names}
    ended = asyncio.run(cancelled_by_signal(_play(seats, run, bus.links(side, seats), place)))
    if isinstance(ended, signal.Signals):
        raise SystemExit(SIGNALLED + ended)


async def _play(seats: dict[str, PersonSeat], run: str, links: Sequence[Link], place: SeatPlace) -> None:
    async with AsyncExitStack() as stack:
        sessions: dict[str, Bus] = {}
        for link in links:
            session = await open_bus(link.config)
            stack.push_async_callback(session.close)
            sessions |= dict.fromkeys(link.names, session)
        await stack.enter_async_context(serve_seats(list(seats.values()), place))
        await asyncio.gather(*(play_seat(seat, sessions[name], run) for name, seat in seats.items()))
