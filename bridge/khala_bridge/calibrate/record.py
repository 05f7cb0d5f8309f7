"""The file of one calibration: which game was measured, and what each probe found.

One JSON object; `khala_sc2.calibrate.compare` compares two. Above: `run`.
"""

from __future__ import annotations

import json
import statistics
from typing import TYPE_CHECKING, Annotated, Final, Literal, Self

from pydantic import AfterValidator, Field, ValidationError, model_validator

from khala_protocol.errors import ConfigError
from khala_protocol.files import read_limited, write_private
from khala_protocol.messages import Frozen
from khala_protocol.visible import visible_line

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

_MOST_BYTES: Final = 64 * 2**20
_DIGITS: Final = 6
_LARGEST: Final = 1e12
"""Beyond all that a game has; statistics of the largest floats overflow."""

Line = Annotated[str, AfterValidator(visible_line)]
"""Words of another machine: on one line, so that they add no heading to a report, nor a row to its tables."""
Number = Annotated[float, Field(ge=-_LARGEST, le=_LARGEST)]


class Values(Frozen):
    """All that was measured under one name."""

    samples: tuple[Number, ...]
    mean: Number
    sd: Number
    """Of the samples; 0 for a single one."""
    n: int

    @model_validator(mode="after")
    def _check_n(self) -> Self:
        if self.n != len(self.samples):
            raise ValueError(f"n is {self.n}, and there are {len(self.samples)} samples")
        return self

    @classmethod
    def of(cls, samples: Iterable[float]) -> Values:
        """Return samples with what sums them up."""
        rounded = tuple(round(float(sample), _DIGITS) for sample in samples)
        sd = statistics.stdev(rounded) if len(rounded) > 1 else 0.0
        return cls(
            samples=rounded, mean=round(statistics.fmean(rounded), _DIGITS), sd=round(sd, _DIGITS), n=len(rounded)
        )


class Measured(Frozen):
    """What one probe found."""

    unit: Line
    exact: bool
    """Whether the game repeats it to the last digit, apart from `resolution`."""
    resolution: Number
    run_s: float
    """Seconds that it took."""
    loops: int
    """Game loops that it played; of a probe with games of its own, those of the last one."""
    failed: Line = ""
    """Why it found nothing: an error of the game, or a unit that did not do what the probe expects."""
    values: dict[Line, Values] = Field(default_factory=dict)


class Calibration(Frozen):
    """One file."""

    kind: Literal["khala-calibration"] = "khala-calibration"
    format: Literal[1] = 1
    khala: Line
    """Version of Khala."""
    game: Line
    """Such as `StarCraft II`, or the simulator by its name."""
    version: Line
    """That the game tells, such as 4.10.0."""
    build: int
    data_version: Line
    platform: Line
    seed: int
    probes: dict[Line, Measured] = Field(default_factory=dict)
    """By id."""

    def with_probe(self, name: str, measured: Measured) -> Calibration:
        """Return it with one more probe, or with another result of one."""
        return self.model_copy(update={"probes": {**self.probes, name: measured}})

    def is_same_game(self, other: Calibration) -> bool:
        """Return True if one can be continued with the other's game and seed."""
        return all(
            getattr(self, name) == getattr(other, name) for name in ("game", "version", "build", "data_version", "seed")
        )

    def save(self, path: Path) -> None:
        """Write it in one step: whoever interrupts finds the file of before or of now."""
        write_private(path, json.dumps(self.model_dump(mode="json"), indent=1) + "\n")


def load(path: Path) -> Calibration:
    """Return the calibration in a file.

    Raises:
        ConfigError: it cannot be read, or is none.
    """
    try:
        return Calibration.model_validate_json(read_limited(path, _MOST_BYTES))
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise ConfigError(f"{path} is not a file of `khala calibrate`: {where or 'it'}: {first['msg']}") from None
