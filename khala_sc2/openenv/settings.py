"""What a server decides, and what it lets its clients choose.

A client names a task of the catalogue, agents, and players that cost nothing; files, code and models are the server's
to name.
"""

from __future__ import annotations

import secrets
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from khala_agents.scripted.players import PLAYERS
from khala_protocol.errors import ConfigError
from khala_sc2.openenv.rubrics import Battle
from khala_sc2.playing.matches import new
from khala_sc2.playing.minds import SCRIPTED, SILENT, Minds, minds_of
from khala_sc2.playing.seats import Seat, SeatedMatch, seat_named, seats_of, without_time_limit

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from openenv.core.rubrics import Rubric

    from khala_bridge.game.processes import Processes
    from khala_bridge.task.config import TaskConfig
    from khala_orchestrator.config import MatchConfig
    from khala_sc2.openenv.models import ResetOptions

EPISODES: Final = 1_000_000
"""Of one match: the game goes on from episode to episode until it is seeded again."""
FREE: Final = frozenset({SILENT, SCRIPTED, *PLAYERS, *(f"{SCRIPTED}/{name}" for name in PLAYERS)})
"""Players that any client may choose."""
_MOST_SEED: Final = 2**30


class ChosenMatch(NamedTuple):
    """A match that a client chose, not begun."""

    match: SeatedMatch
    config: MatchConfig


@dataclass(frozen=True, slots=True)
class ServerSettings:
    """What a server decides.

    Attributes:
        task: what is played if a client names none: a task, or a path to one.
        others: who decides for agents that no client plays.
        allowed: models and policies that a client may choose as well as `FREE`.
        rubric: makes what a step is worth, for each session.
        game: `simulator`, `starcraft2`, or a directory.
        out: directory of the recordings; None for none.
    """

    task: str = "2s3z_pair"
    others: str = "skilled"
    allowed: Sequence[str] = ()
    rubric: Callable[[], Rubric] = Battle
    game: str = "simulator"
    out: Path | None = None

    def match(self, options: ResetOptions, processes: Processes | None = None) -> ChosenMatch:
        """Return the match that a client chose.

        Args:
            options: what it chose.
            processes: where the process of the game comes from, and goes afterwards.

        Raises:
            ConfigError: it may not, or there is no such task, agent or picture.
        """
        config = self._config(options)
        seats = _seats(config.task, options.agents)
        others = options.others or self.others
        if others not in {*FREE, self.others, *self.allowed}:
            raise ConfigError(
                f"this server does not let a client choose {others!r}: it may be one of "
                f"{', '.join(sorted({*FREE, self.others, *self.allowed}))}",
                source="others",
            )
        minds = minds_of([side.side for side in config.task.per_side()], Minds().with_name(others), {})
        return ChosenMatch(SeatedMatch(config, seats, minds, game=self.game, processes=processes), config)

    def _config(self, options: ResetOptions) -> MatchConfig:
        name = options.task or self.task
        if name != self.task and not name.replace("_", "").replace("-", "").isalnum():
            raise ConfigError(f"{name!r} is not the name of a task: `khala tasks` lists them", source="task")
        given = {
            "seed": secrets.randbelow(_MOST_SEED) if options.seed is None else options.seed,
            "episodes": EPISODES,
            "assemble_s": None,
            "images": options.images,
            "max_steps": options.max_steps,
            "step_loops": options.step_loops,
        }
        config = new(name, None, self.out or Path(), **given)
        changes: dict[str, object] = {"task": without_time_limit(config.task)}
        if self.out is None:
            changes["record"] = None
        return config.model_copy(update=changes)


def _seats(task: TaskConfig, names: Sequence[str] | None) -> list[Seat]:
    """Return the seats of a session.

    Raises:
        ConfigError: there is no such agent, or they are of two sides.
    """
    there_are = seats_of(task)
    if names is None:
        return [seat for seat in there_are if seat.side == there_are[0].side]
    seats = [seat_named(name, there_are, source="agents") for name in dict.fromkeys(names)]
    if len({seat.side for seat in seats}) > 1:
        raise ConfigError("a session plays agents of one side: `others` decide for the other one", source="agents")
    return seats
