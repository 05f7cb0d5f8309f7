"""What travels between a client and the server: the action, the observation, the state, and the options of a reset."""

from __future__ import annotations

from typing import Literal

from openenv.core.env_server.types import Action, Observation, State
from pydantic import BaseModel, ConfigDict, Field

from khala_protocol.messages import Ending  # pydantic evaluates it


class KhalaAction(Action):
    """The replies of the agents, in the text language."""

    reply: str | None = Field(default=None, description="Of the agent, if the session plays one.")
    replies: dict[str, str] = Field(
        default_factory=dict,
        description="By agent, if the session plays several. Who is asked and not named does nothing.",
    )


class ChatTurn(BaseModel):
    """A message of a chat."""

    role: Literal["system", "user", "assistant"]
    content: str


class Picture(BaseModel):
    """A picture that an agent sees."""

    title: str = Field(description="One line that explains it to a model.")
    media_type: str
    data: str = Field(description="The file, in base64.")


class AgentView(BaseModel):
    """What an agent sees that is asked."""

    text: str = Field(description="The observation in words.")
    briefing: list[ChatTurn] = Field(
        default=[],
        description="In the first observation of an episode: the messages that stand before all of its observations. "
        "They say who it is, what it may do and how, and have an example.",
    )
    accepted: list[str] = Field(default=[], description="Its calls of the last step that were carried out.")
    rejections: list[str] = Field(default=[], description="Those that were not, each with the reason.")
    pictures: list[Picture] = []


class Outcome(BaseModel):
    """How an episode ended."""

    outcome: Ending
    cause: str = Field(description="`enemy defeated`, `defeated`, `time limit`, `step limit`, …")
    valid: bool = Field(description="False if a part of the match failed, and it says nothing about the agents.")
    killed_value: float = Field(description="Minerals and vespene of all that the side destroyed.")
    lost_value: float
    steps: int = Field(description="Number of decisions.")
    game_s: float


class KhalaObservation(Observation):
    """What the agents of a session see, and what has happened since its observation before."""

    episode_id: str = ""
    agents: dict[str, AgentView] = Field(
        default_factory=dict, description="Those who are asked, by name. The others are dead, or have nothing to say."
    )
    step: int = Field(default=0, description="Of the match.")
    killed_value: float = Field(default=0.0, description="Minerals and vespene of what the side destroyed.")
    lost_value: float = 0.0
    accepted: int = Field(default=0, description="Calls of the session's agents that were carried out.")
    refused: int = Field(default=0, description="Calls that were not.")
    elapsed_s: float = Field(default=0.0, description="Seconds of the game.")
    result: Outcome | None = Field(default=None, description="At the end of an episode.")
    scores: dict[str, float] = Field(default_factory=dict, description="What each rubric gave, by its name.")

    @property
    def text(self) -> str:
        """What the only agent sees that is asked; empty at the end of an episode.

        Raises:
            ValueError: there are several.
        """
        if len(self.agents) > 1:
            raise ValueError(f"{', '.join(self.agents)} are asked: read `agents`, which has the observation of each")
        return "".join(view.text for view in self.agents.values())


class KhalaState(State):
    """What is played in a session."""

    task: str = ""
    side: str = ""
    agents: list[str] = Field(default_factory=list, description="Those that the session plays.")
    seed: int | None = Field(default=None, description="Of the episode.")
    over: bool = Field(default=False, description="Whether the episode is over.")
    recording: str | None = Field(default=None, description="On the server.")


class ResetOptions(BaseModel):
    """What a client may say with `reset`."""

    model_config = ConfigDict(extra="forbid")

    seed: int | None = Field(
        default=None,
        ge=0,
        lt=2**31,
        description="A new game, in which everything follows from it and the replies. None: the game goes on.",
    )
    episode_id: str | None = Field(default=None, min_length=1, max_length=255, description="A name for the episode.")
    task: str | None = Field(default=None, description="One of `khala tasks`; None: the server's.")
    agents: list[str] | None = Field(
        default=None,
        min_length=1,
        description="Those that the session plays, of one side: Stalkers, red/Captain. None: all of the first side.",
    )
    others: str | None = Field(
        default=None,
        description="Who decides for all other agents: silent, skilled, focus-fire, random-legal, or what the server "
        "allows. None: as the server says.",
    )
    images: str | None = Field(
        default=None, description="Pictures: paper (those of their kind), none, or a list such as screen,minimap."
    )
    max_steps: int | None = Field(default=None, ge=1, description="End an episode after this many steps.")
    step_loops: int | None = Field(default=None, ge=1, description="Game loops between two observations.")

    def choice(self) -> ResetOptions:
        """Return what makes a match another one: all but the seed and the name of the episode."""
        return self.model_copy(update={"seed": None, "episode_id": None})
