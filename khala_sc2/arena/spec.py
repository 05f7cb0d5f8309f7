"""The file of an arena: who plays, on which tasks, in which pairing, and which players fix the scale.

    name: small
    players:
      - {name: skilled, model: skilled}
      - {name: gpt, model: openai/gpt-5}
      - {name: easy, level: easy}
    groups:
      duels: [duel_3m, duel_2s3z]
      battles: [3s5z]
      full games: [simple64_eceb_terran]
    anchors: {skilled: 1200}
    rounds: 4

On a task of two sides, players with a model meet each other, with the sides swapped. On a full game of one side they
meet levels of the computer and guests. On a battle, whose units the map places, they meet the map's own computer
player, which is a player of the pool under the name of the task.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from khala_bridge.task.maps import Difficulty  # noqa: TC001  # pydantic evaluates it
from khala_protocol.errors import WrongKey
from khala_protocol.keys import check_name
from khala_protocol.messages import Frozen
from khala_sc2.experiment.spec import ExperimentBudget, Settings

OVERALL = "overall"
"""Name of the column of the means over all groups."""


def _check_name(value: str) -> str:
    try:
        return check_name(value, "name")
    except WrongKey as error:
        raise ValueError(str(error)) from None


Name = Annotated[str, AfterValidator(_check_name)]
Words = Annotated[str, Field(min_length=1, max_length=60, pattern=r"^[\w .+-]+$")]
"""A name of a group, which people read."""


class ArenaPlayer(Frozen):
    """A member of the pool: what decides for it."""

    name: Name
    model: str | None = None
    """Of its agents: a model, a model and its name at the endpoint (`openai/gpt-5`), a scripted player (`skilled`), or
    a policy (`my_agent:decide`)."""
    level: Difficulty | None = None
    """Instead: the computer, at this level."""
    guest: str | None = None
    """Instead: a bot that is started by this command, with the arguments of the ladder appended."""

    @model_validator(mode="after")
    def _is_something(self) -> Self:
        if sum(value is not None for value in (self.model, self.level, self.guest)) != 1:
            raise ValueError(f"the player {self.name} needs a model, a level or a guest, and only one of them")
        return self


class Arena(Frozen):
    """One arena."""

    name: Name
    description: str = ""
    players: tuple[ArenaPlayer, ...] = Field(min_length=2)
    groups: dict[Words, tuple[str, ...]] = Field(min_length=1)
    """Tasks by group: by name, or as a path. Each group gets ratings of its own."""
    anchors: dict[str, float] = Field(min_length=1)
    """Ratings of players that fix the scale: the mean of theirs is the mean of these, in every group. Two arenas with
    the same anchors have the same scale in groups of the same tasks. Take players who win and lose in every group."""
    fixed: Settings = Settings()
    """Settings of all matches, as in an experiment: `clock`, `rhythm`, `max_steps`, …"""
    pairing: Literal["round-robin", "swiss"] = "round-robin"
    """`round-robin`: everybody meets everybody in each round. `swiss`: each player meets in each round an opponent of
    about its rating whom it has met least."""
    rounds: int = Field(default=4, ge=1, le=1000)
    """The number of a round is the seed of its matches."""
    budget: ExperimentBudget = ExperimentBudget()
    retries: int = Field(default=2, ge=0, le=20)
    """How often a match that crashed is played again."""
    match_hours: float = Field(default=6.0, gt=0)
    """A match that takes longer is ended, and counts as crashed."""

    @model_validator(mode="after")
    def _known_names(self) -> Self:
        names = [player.name for player in self.players]
        if twice := next((name for name in names if names.count(name) > 1), None):
            raise ValueError(f"there are two players {twice}")
        if strange := next((name for name in self.anchors if name not in names), None):
            raise ValueError(f"the anchor {strange} is no player; the players are {', '.join(names)}")
        if OVERALL in self.groups:
            raise ValueError(f"the group {OVERALL} is the mean of all groups: choose another name")
        tasks = [task for group in self.groups.values() for task in group]
        if twice := next((task for task in tasks if tasks.count(task) > 1), None):
            raise ValueError(f"the task {twice} is there twice")
        return self

    @model_validator(mode="after")
    def _settings_of_all(self) -> Self:
        own = {"task", "model", "agents", "sides", "level"} & self.fixed.model_fields_set
        if own:
            raise ValueError(f"fixed has {min(own)}, which players and groups say")
        return self

    def player(self, name: str) -> ArenaPlayer:
        """Return the player of this name."""
        return next(player for player in self.players if player.name == name)
