"""The work of `khala mcp`: the match that its options describe, and who plays it."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from khala_protocol.errors import ConfigError
from khala_protocol.trust import trust_named
from khala_sc2.mcp.table import Table
from khala_sc2.playing.matches import new
from khala_sc2.playing.minds import Minds, minds_of
from khala_sc2.playing.seats import seat_named, seats_of, without_time_limit

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path


@dataclass(frozen=True, slots=True)
class WantedSeats:
    """What the command line says; names are those of its options."""

    task: str | None
    seats: Sequence[str]
    port: int | None
    others: str
    budget_usd: float | None
    game: str
    run: str | None
    out: Path
    match: Mapping[str, Any]
    """How it is played, as `khala_sc2.playing.matches.new` takes it."""


def run_mcp(wanted: WantedSeats) -> None:
    """Serve the seats of a match until the client leaves, or a signal comes.

    Raises:
        ConfigError: an option is wrong, or the SDK is not installed.
    """
    try:
        from khala_sc2.mcp.serve import over_http, over_stdio  # noqa: PLC0415  # of the extra `mcp`
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"there is no module {error.name}: pip install 'khala-sc2[mcp]'", source="khala mcp"
        ) from None
    table = table_of(wanted)
    asyncio.run(over_stdio(table) if wanted.port is None else over_http(table, wanted.port))


def table_of(wanted: WantedSeats) -> Table:
    """Return the match, with places for those who connect.

    Raises:
        ConfigError: an option is wrong.
    """
    if wanted.task is None:
        raise ConfigError("give a task, such as 2s3z_pair: `khala tasks` lists them")
    config = new(wanted.task, wanted.run, wanted.out, **wanted.match)
    if wanted.match["max_wait_s"] is None:
        config = config.model_copy(update={"task": without_time_limit(config.task)})
    there_are = seats_of(config.task)
    seats = [seat_named(name, there_are, source="--seat") for name in wanted.seats]
    if wanted.port is None:
        if len(seats) > 1:
            raise ConfigError("over stdio one client plays one agent: give one seat, or --port", source="--seat")
        seats = seats or there_are[:1]
    sides = [side.side for side in config.task.per_side()]
    trust_named(wanted.others)
    minds = minds_of(sides, Minds(budget_usd=wanted.budget_usd).with_name(wanted.others), {})
    return Table(config, seats or there_are, minds, game=wanted.game)
