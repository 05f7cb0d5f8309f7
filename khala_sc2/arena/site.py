"""A static site of ratings: the leaderboard, for each of its ratings the matches, and for each match its page.

    index.html                     a table of ratings for each group, and one of their means
    games/PLAYER.GROUP.html        the games of a rating
    matches/KEY.html               a match, as `khala view --export` writes it

Pages load nothing, run no script of their own, and need no server. Names may come from anyone's file.
"""

from __future__ import annotations

import hashlib
import html
import logging
import re
from typing import TYPE_CHECKING

from khala_orchestrator.past.transcript import StepSelection
from khala_protocol.errors import KhalaError
from khala_protocol.files import make_private, write_private
from khala_protocol.visible import visible_line
from khala_sc2.arena.leaderboard import (
    basis_of,
    columns_of,
    detail_names,
    details_of,
    interval_of,
    remarks_of,
)
from khala_sc2.arena.ratings import games_of, outcome_for, seat_of
from khala_sc2.experiment.report.html import STYLE
from khala_sc2.view.export import export
from khala_sc2.view.server import page
from khala_sc2.view.sources import Sources

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

    from khala_sc2.arena.ratings import Leaderboard, LeaderboardLine, Rating
    from khala_sc2.arena.results import ArenaGame, PlayerPool

log = logging.getLogger(__name__)

GAMES, MATCHES, INDEX = "games", "matches", "index.html"
BAR_PX = 110
OURS = """
body { max-width: 84rem; }
a { color: inherit; text-decoration-color: var(--faint); text-underline-offset: .2em; }
td small { color: var(--faint); }
th:first-child, td:first-child { position: sticky; left: 0; background: var(--back); }
td svg { display: block; }
.whisker { stroke: var(--ink); stroke-width: 1.5; }
.dot { fill: var(--ink); }
.win { color: #1a7f4b; } .loss { color: #c0392b; }
@media (prefers-color-scheme: dark) { .win { color: #5fd39a; } .loss { color: #ff8a7a; } }
"""


def make_site(pool: PlayerPool, board: Leaderboard, into: Path) -> int:
    """Write a site, and return how many matches have a page; pages of matches that are there already stay.

    Raises:
        ConfigError: it cannot be written, or the page of `khala view` is not built.
    """
    for directory in (into, into / GAMES, into / MATCHES):
        make_private(directory)
    shown = {game.match for game in pool.games if _write_match(pool, game, into)}
    title = ", ".join(dict.fromkeys(pool.arenas))
    write_private(into / INDEX, _page(f"Ratings: {title}", _leaderboard(pool, board)))
    for line in board.players:
        for column in line.ratings:
            games = games_of(pool.games, line.player, column)
            content = _games(pool, line, games, shown)
            write_private(into / _place(line.player, column), _page(f"{line.player}, {column}", content))
    return len(shown)


def _write_match(pool: PlayerPool, game: ArenaGame, into: Path) -> bool:
    """Write the page of a match; return whether there is one."""
    path = into / MATCHES / f"{game.match}.html"
    recording = pool.places[game.match]
    if path.exists():
        return True
    if not recording.is_file():
        return False
    title = f"{game.task}: {game.first.player} and {game.second.player}, seed {game.seed}"
    try:
        export(Sources(title, None, [recording]), page(), path, steps=StepSelection.of(None, None), agents=())
    except KhalaError as error:
        log.warning("%s gets no page: %s", recording, error)
        return False
    return True


def _place(player: str, group: str) -> str:
    """Return the path of a cell's page: readable, and different for each cell whatever its names are."""
    digest = hashlib.sha256(f"{player}\n{group}".encode()).hexdigest()[:6]
    words = re.sub(r"[^A-Za-z0-9-]+", "-", f"{player}.{group}")[:60]
    return f"{GAMES}/{words}-{digest}.html"


# --- the leaderboard ---------------------------------------------------------------------------------


def _leaderboard(pool: PlayerPool, board: Leaderboard) -> Iterator[str]:
    yield f"<p>{len(pool.games)} games of {len(board.players)} players. Each rating is a link to its games.</p>"
    for column in board.columns:
        yield f"<section>\n<h2>{_safe(column)}</h2>\n<p>{_safe(basis_of(board, column))}.</p>"
        yield from _table(board, column)
        yield "</section>"
    yield "<section>\n<h2>What these numbers say</h2>\n<ul>"
    yield from (f"<li>{_safe(remark)}</li>" for remark in remarks_of(board, pool.remarks))
    yield "</ul>\n</section>"


def _table(board: Leaderboard, column: str) -> Iterator[str]:
    columns = columns_of(board, column)
    standings = board.standings(column)
    ratings = [line.ratings[shown] for line in standings for shown in columns]
    low = min((rating.low for rating in ratings), default=0.0)
    high = max((rating.high for rating in ratings), default=1.0)
    yield '<div class="scroll"><table><thead><tr><th>player</th>'
    yield from (f"<th>{_safe(name)}</th>" for name in columns)
    yield from (f"<th>{name}</th>" for name in detail_names(board, column))
    yield "</tr></thead><tbody>"
    for line in standings:
        about = [line.about] if line.about != line.player else []
        small = " · ".join([*about, *(["anchor"] if line.is_anchor else [])])
        yield f"<tr><td>{_safe(line.player)}<br><small>{_safe(small)}</small></td>"
        yield from (f"<td>{_rating(line.player, shown, line.ratings[shown], low, high)}</td>" for shown in columns)
        yield from (f"<td>{_safe(words)}</td>" for words in details_of(board, column, line.ratings[column]))
        yield "</tr>"
    yield "</tbody></table></div>"


def _rating(player: str, column: str, rating: Rating, low: float, high: float) -> str:
    words = f"{rating.value:.0f} <small>{interval_of(rating)}</small>"
    return f'<a href="{_place(player, column)}">{words}</a>{_whisker(rating, low, high)}'


def _whisker(rating: Rating, low: float, high: float) -> str:
    """Return a picture of a rating and its interval, on the scale of all ratings of its table."""
    span = max(high - low, 1.0)
    at, begin, end = (6 + (BAR_PX - 12) * (x - low) / span for x in (rating.value, rating.low, rating.high))
    return (
        f'<svg width="{BAR_PX}" height="12" role="img" aria-label="interval {rating.low:.0f} to {rating.high:.0f}">'
        f'<line class="whisker" x1="{begin:.1f}" x2="{end:.1f}" y1="6" y2="6"/>'
        f'<circle class="dot" cx="{at:.1f}" cy="6" r="3.5"/></svg>'
    )


# --- the games of a rating ---------------------------------------------------------------------------


def _games(pool: PlayerPool, line: LeaderboardLine, games: Sequence[ArenaGame], shown: set[str]) -> Iterator[str]:
    yield f'<p><a href="../{INDEX}">All ratings</a>. {_safe(line.kind)}: {_safe(line.about)}.</p>'
    names = ("outcome", "against", "task", "side", "seed", "ended by", "game time", "killed", "lost", "tokens",
             "clock", "variant", "match")  # fmt: skip
    yield '<div class="scroll"><table><thead><tr>'
    yield "".join(f"<th>{name}</th>" for name in names)
    yield "</tr></thead><tbody>"
    for game in games:
        yield f"<tr>{_game(pool, line.player, game, has_page=game.match in shown)}</tr>"
    yield "</tbody></table></div>"


def _game(pool: PlayerPool, player: str, game: ArenaGame, *, has_page: bool) -> str:
    is_first = game.first.player == player
    other = game.second.player if is_first else game.first.player
    outcome = outcome_for(game, player)
    killed, lost = (game.killed, game.lost) if is_first else (game.lost, game.killed)
    seat = seat_of(game, player)
    match = f'<span title="{game.match}">{game.match[:8]}</span>'
    if has_page:
        match = f'<a href="../{MATCHES}/{game.match}.html">{match}</a>'
    about = pool.players[other].about
    return (
        f'<td class="{outcome}">{outcome}</td><td title="{_safe(about)}">{_safe(other)}</td><td>{_safe(game.task)}</td>'
        f"<td>{'first' if is_first else 'second'}</td>"
        f'<td class="number">{game.seed}</td><td>{_safe(game.cause)}</td>'
        f'<td class="number">{game.game_s:.0f} s</td><td class="number">{killed:.0f}</td>'
        f'<td class="number">{lost:.0f}</td><td class="number">{seat.tokens if seat else 0}</td>'
        f"<td>{_safe(game.clock)}</td><td>{game.variant}</td><td>{match}</td>"
    )


# --- a page ------------------------------------------------------------------------------------------


def _page(title: str, content: Iterable[str]) -> str:
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        """<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">\n"""
        f"<title>{_safe(title)}</title>\n<style>{STYLE}{OURS}</style>\n</head>\n<body>\n<h1>{_safe(title)}</h1>\n"
        + "\n".join(content)
        + "\n</body>\n</html>\n"
    )


def _safe(words: str) -> str:
    return html.escape(visible_line(words))
