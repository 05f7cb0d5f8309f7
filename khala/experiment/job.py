"""What an engine is asked, and what it answers: one match."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003  # pydantic evaluates it
from typing import Literal

from khala.playing.minds import Minds  # noqa: TC001  # pydantic evaluates it
from khala_orchestrator.config import MatchConfig  # noqa: TC001
from khala_protocol.messages import Frozen

DoneState = Literal["done", "error", "timeout", "lost"]


class Job(Frozen):
    """One match to play. It is recorded at `config.record`."""

    config: MatchConfig
    minds: dict[str, Minds]
    """By side, with its budget."""
    timeout_s: float
    processes: bool = False
    """Whether agents get processes of their own."""
    beginning: Path | None = None
    """A recording of what was played of it before; its agents go on from there."""

    @property
    def directory(self) -> Path:
        """Where its recording is."""
        assert self.config.record is not None, "matches of an experiment are recorded"
        return self.config.record.parent


class Done(Frozen):
    """How a match ended."""

    state: DoneState
    """`done`: its results are in the recording; `lost`: the process that played it died without a word."""
    words: str = ""
    """Why it is not valid, or what went wrong."""
