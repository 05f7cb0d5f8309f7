"""Quick save and quick load: a game kept in memory, to continue from there.

The copies share what never changes (tables, the map, the looks of images).

Above: `play.py`. Below: `process.py`.
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_simulator.process.process import Playing


def keep(playing: Playing) -> None:
    """Mark the present state of a game, in place of an earlier mark."""
    playing.bookmark = None
    playing.bookmark = _copy(playing)


def reopen(playing: Playing) -> Playing | None:
    """Return the game in its marked state, any number of times; None without a mark."""
    if playing.bookmark is None:
        return None
    game = _copy(playing.bookmark)
    game.bookmark = playing.bookmark
    if game.clock is not None:
        game.clock.go_on()
    return game


def _copy(playing: Playing) -> Playing:
    return copy.deepcopy(playing, {id(part): part for part in _unchanging(playing)})


def _unchanging(playing: Playing) -> Iterator[object]:
    game = playing.game
    game_map = game.setup.game_map
    yield from (playing.party, game.setup, game_map, game_map.terrain, game_map.scenario, game.catalog, game.types)
    for seat in (*game.seats.values(), playing.seat):
        yield from (seat.options, seat.view, seat.views, seat.layers, seat.renders)
