"""One row of a data set: a decision of an agent with all that is known of it, or two observations of a world model."""

from __future__ import annotations

from dataclasses import dataclass, replace
from hashlib import sha256
from typing import TYPE_CHECKING, NamedTuple, TypedDict

from khala_sc2.dataset.prompts import without_example

if TYPE_CHECKING:
    from collections.abc import Mapping

    from khala_protocol.messages import (
        ChatMessage,
        Clock,
        Fate,
        ImageRef,
        Observation,
        Rejection,
        Result,
        Run,
        TokenTrace,
        Usage,
        Variant,
        View,
    )
    from khala_sc2.dataset.rewards import Reward

UNFINISHED = "unfinished"
"""The outcome of an episode whose recording ends before it does."""


class RowPicture(NamedTuple):
    """A picture that was sent with a prompt."""

    ref: ImageRef
    data: bytes

    @property
    def file_name(self) -> str:
        """The name of a file with it: the hash of its bytes, and its format."""
        return f"{sha256(self.data).hexdigest()[:32]}.{self.ref.media_type.partition('/')[2]}"


class OrderOfSide(NamedTuple):
    """An action that was carried out, when it took effect."""

    game_loop: int
    agent: str
    action: str
    """With its team in front, `Zealot-1 <Attack_Unit(0x100280000)>`."""


class NextObservation(NamedTuple):
    """The observation that followed, in a data set of dynamics (`khala_sc2.dataset.dynamics`)."""

    step: int
    game_loop: int
    observation: str
    """The words of the observation before; the reply of the row has those of the next."""
    orders: tuple[OrderOfSide, ...]
    """Of the whole side, between the two observations."""
    clock: Clock
    fog: str | None
    """What the side saw of the map at the observation before, as `Scene.fog` has it; None if it was not recorded."""
    view: View
    """The data that the words before were made from."""
    next_view: View


@dataclass(frozen=True, slots=True)
class Row:
    """One decision of one agent; in a data set of dynamics, one observation, and the next one as its reply."""

    run: str
    task: str
    variant: Variant
    """Of the task: what was played, as its published files or as its paper has it."""
    map_name: str
    game: str
    versions: Mapping[str, str]
    seed: int
    """Of the episode: that of the run, and one more for each episode."""
    side: str
    agent: str
    episode: int
    step: int
    game_loop: int
    prompt: tuple[ChatMessage, ...]
    prompt_recorded: bool
    """Whether a model got this prompt; otherwise it is made of the briefing and the observation."""
    example: int
    """How many messages after the first one are the worked example: 2 or 0."""
    pictures: tuple[RowPicture, ...]
    """Those sent with the prompt that are in the recording, in their order."""
    reply: str
    status: str
    model: str
    """As its endpoint calls it; `human` for a person, "" if neither gave the reply."""
    usage: Usage
    accepted: tuple[str, ...]
    rejections: tuple[Rejection, ...]
    fate: Fate | None
    age_loops: int
    reward: Reward
    """Of the side."""
    own_reward: Reward
    """Of the agent: `khala_sc2.dataset.credit.own_reward` of its turn."""
    tokens: TokenTrace
    """Of the request whose answer the reply is; empty as far as the endpoint told none, or there was none."""
    outcome: str
    valid: bool
    following: NextObservation | None = None
    """Only in a data set of dynamics."""

    @property
    def id(self) -> str:
        """The place of the decision, as one text."""
        return f"{self.run}/{self.side}/{self.agent}/{self.episode}/{self.step}"

    def without_example(self) -> Row:
        """Return the row with a prompt that has no worked example."""
        return replace(self, prompt=without_example(self.prompt, self.example), example=0)


class RowOrigin(TypedDict):
    """The fields of a row that say where it is from, and how its episode ended."""

    run: str
    task: str
    variant: Variant
    map_name: str
    game: str
    versions: Mapping[str, str]
    seed: int
    side: str
    agent: str
    episode: int
    step: int
    game_loop: int
    outcome: str
    valid: bool


def origin_of(run: Run, seen: Observation, result: Result | None) -> RowOrigin:
    """Return where the row of an observation is from; `result` is that of its episode, None if that has no end."""
    return RowOrigin(
        run=run.run,
        task=run.task,
        variant=run.variant,
        map_name=run.map_name,
        game=run.game,
        versions=run.versions,
        seed=run.seed + seen.episode,
        side=seen.side,
        agent=seen.agent,
        episode=seen.episode,
        step=seen.step,
        game_loop=seen.game_loop,
        outcome=result.outcome if result else UNFINISHED,
        valid=result.valid if result else False,
    )
