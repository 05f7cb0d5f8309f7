"""The recorded future: an episode played once more with its recorded decisions, and compared with what was recorded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from khala_orchestrator.match.match import SilentObserver
from khala_orchestrator.past.fork import write_whole
from khala_orchestrator.past.replay import recorded_config, replay
from khala_protocol.recording import Recording
from khala_sc2.playing import games
from khala_sc2.playing.hosting import game_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from khala_orchestrator.past.fork import Trunk
    from khala_protocol.messages import Result
    from khala_protocol.recording.difference import Difference

OF_THIS_TIME = {"run", "episode", "wall_s", "latency_p50_s", "latency_p95_s", "lag_s", "incidents"}
"""Fields of a result that do not follow from the game and the decisions."""


@dataclass(frozen=True, slots=True)
class Repeated:
    """A recorded episode that was played once more.

    Attributes:
        results: of this time.
        differences: observations that are not the recorded ones; no others follow the first step that has some.
        same: whether it ended exactly as it was recorded, as far as it was.
    """

    results: Sequence[Result]
    differences: Sequence[Difference]
    same: bool


class _Results(SilentObserver):
    def __init__(self) -> None:
        self.taken: list[Result] = []

    async def result(self, result: Result) -> None:
        self.taken.append(result)


async def play_recorded(trunk: Trunk, directory: Path, *, game: str) -> Repeated:
    """Play a recorded episode with its recorded decisions.

    Args:
        trunk: the episode.
        directory: for a copy of it.
        game: as in `khala_sc2.playing.games.find`.
    """
    path = directory / "recorded.mcap"
    write_whole(trunk, path)
    copy = Recording.open(path)
    results = _Results()
    sc2path, _ = games.find(game)
    async with game_of(recorded_config(copy), sc2path) as sides:
        differences = await replay(copy, sides, observer=results)
    same = not differences and (not trunk.results or _same(trunk.results, results.taken))
    return Repeated(results.taken, differences, same=same)


def _same(recorded: Sequence[Result], taken: Sequence[Result]) -> bool:
    """Return whether the results are the recorded ones, in all that recordings of that version say."""
    if len(recorded) != len(taken):
        return False
    said = [before.model_fields_set - OF_THIS_TIME for before in recorded]
    return all(
        before.model_dump(include=fields) == now.model_dump(include=fields)
        for before, now, fields in zip(recorded, taken, said, strict=True)
    )
