"""Which rows are exported, and into which split each goes."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Literal, Self

from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from khala_sc2.dataset.row import Row

SplitBy = Literal["seed", "run", "task"]
ExampleRule = Literal["weighted", "none"]
"""What becomes of the worked example: it stays in prompts, and chats give its reply the weight 0; or it is left out."""


class Only(StrEnum):
    """What holds for every row."""

    WINS = "wins"
    """Its side won the episode."""
    VALID = "valid"
    """The episode says something about its agents."""
    ACCEPTED = "accepted"
    """It had an action, and none was refused."""
    OK = "ok"
    """The agent decided itself."""


FILTERS: Mapping[Only, Callable[[Row], bool]] = {
    Only.WINS: lambda row: row.outcome == "win",
    Only.VALID: lambda row: row.valid,
    Only.ACCEPTED: lambda row: bool(row.accepted) and not row.rejections,
    Only.OK: lambda row: row.status == "ok",
}

_NAMES = {1: ("train",), 2: ("train", "test"), 3: ("train", "validation", "test")}


@dataclass(frozen=True, slots=True)
class RowChoice:
    """Which rows are exported."""

    only: tuple[Only, ...] = ()
    """All of these hold for a row."""
    agents: tuple[str, ...] = ()
    """Names, or with the side before them (`red/Captain`); none: every agent."""

    def why_not(self, row: Row) -> str | None:
        """Return why a row is not exported; None if it is."""
        if self.agents and not {row.agent, f"{row.side}/{row.agent}"} & set(self.agents):
            return "another agent"
        return next((f"not {name}" for name in self.only if not FILTERS[name](row)), None)


@dataclass(frozen=True, slots=True)
class Split:
    """The parts of a data set. What has the same seed (run, task) is in the same part, in every export."""

    shares: tuple[float, ...] = (1.0,)
    by: SplitBy = "seed"

    @classmethod
    def of(cls, text: str, by: SplitBy) -> Self:
        """Return the split of the command line, `0.8,0.1,0.1`.

        Raises:
            ConfigError: it is none.
        """
        try:
            shares = tuple(float(part) for part in text.split(","))
        except ValueError:
            shares = ()
        if len(shares) not in _NAMES or min(shares) <= 0 or not math.isclose(sum(shares), 1.0, abs_tol=1e-6):
            raise ConfigError(
                f"'{text[:40]}' is not a split: write one, two or three shares above 0 that sum up to 1, such as "
                "0.8,0.1,0.1 for train, validation and test",
                source="--split",
            )
        return cls(shares, by)

    @property
    def names(self) -> Sequence[str]:
        """The names of its parts."""
        return _NAMES[len(self.shares)]

    def part(self, row: Row) -> str:
        """Return the part that a row belongs to: the hash of its seed, as a number from 0 to 1, falls into it."""
        digest = hashlib.sha256(f"{self.by} {getattr(row, self.by)}".encode()).digest()
        at = int.from_bytes(digest[:8]) / 2**64
        end = 0.0
        for name, share in zip(self.names, self.shares, strict=True):
            end += share
            if at < end:
                return name
        return self.names[-1]
