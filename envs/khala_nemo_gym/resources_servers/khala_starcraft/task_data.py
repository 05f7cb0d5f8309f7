"""What a row says of its episode, beside the keys of the framework."""

from __future__ import annotations

from typing import Any, Final

from pydantic import BaseModel, ConfigDict, Field

CONSUMED: Final[dict[str, Any]] = {"consumed_by": ["verify"]}


class TaskData(BaseModel):
    """A game, and the agent that the model plays in it."""

    model_config = ConfigDict(extra="allow")

    battle: str = Field("2s3z", description="The task: one of `khala tasks`.", json_schema_extra=CONSUMED)
    agent: str | None = Field(
        None, description="Whom the model plays; None for the first agent of the task.", json_schema_extra=CONSUMED
    )
    seed: int = Field(1, ge=0, lt=2**31, description="Of the game.", json_schema_extra=CONSUMED)
    others: str = Field(
        "skilled",
        description="Who decides for all other agents: a player that costs nothing, such as skilled or silent.",
        json_schema_extra=CONSUMED,
    )
    max_steps: int | None = Field(
        None, ge=1, description="End of the episode; None for the task's own.", json_schema_extra=CONSUMED
    )
