"""The configuration of a match: a task file, and the changes that the command line makes to it.

Task files are found by name in `configs/tasks/`, or by path. Their model is
`khala_bridge.task.config.TaskConfig`. A map without a task file is a task, too: `khala_bridge.task.standard` makes it.
"""

from __future__ import annotations

import difflib
import secrets
from datetime import UTC, datetime
from pathlib import Path  # noqa: TC003  # pydantic evaluates it
from typing import TYPE_CHECKING, Any, Self, get_args

from pydantic import Field, ValidationError, model_validator

from khala_bridge.task.config import TaskConfig
from khala_bridge.task.images import images_for
from khala_bridge.task.maps import Difficulty, known_maps
from khala_bridge.task.opponent import opponent_of
from khala_bridge.task.standard import standard_task
from khala_configs import CONFIGS
from khala_protocol.configfile import load, words_of
from khala_protocol.errors import ConfigError
from khala_protocol.keys import check_name
from khala_protocol.messages import Clock, Forked, Frozen, MemoryRule

if TYPE_CHECKING:
    from collections.abc import Iterator


class MatchConfig(Frozen):
    """One run: a task, played for a number of episodes."""

    task: TaskConfig
    run: str
    """Its name on the bus, in the recording and in every table."""
    game: str = "StarCraft II"
    """The game. The simulator speaks the game's protocol so well that only the process that starts it knows it."""
    seed: int = Field(default=1, ge=0, lt=2**31)
    """Seed of the first episode; each further one adds 1."""
    episodes: int = Field(default=1, ge=1)
    assemble_s: float = Field(default=60.0, gt=0)
    """How long the host waits for its agents at the start."""
    record: Path | None = None
    """The MCAP file that every topic is written to; None for no recording."""
    labels: dict[str, str] = Field(default_factory=dict)
    """For the run card: what an experiment calls this match."""
    rethink: dict[str, int] = Field(default_factory=dict)
    """For the run card: by agent that rethinks, how often in a step (`khala run --rethink`)."""
    humans: frozenset[tuple[str, str]] = frozenset()
    """For the run card: side and name of each agent that a person plays (`khala run --person`)."""
    forked: Forked | None = None
    """Where it was forked from another match."""

    @model_validator(mode="after")
    def _once_over_lan(self) -> Self:
        if self.episodes > 1 and self.task.opponent.kind == "lan":
            raise ValueError("a game over LAN is played once: its host has to begin each game; give one episode")
        return self


def task_files() -> Iterator[Path]:
    """Yield the shipped task files, in the order of their names."""
    yield from sorted((CONFIGS / "tasks").rglob("*.yaml"), key=lambda path: (path.parent.name, path.stem))


def all_tasks() -> Iterator[TaskConfig]:
    """Yield everything that can be played by name: the shipped task files, then the maps that have none."""
    files = {path.stem: path for path in task_files()}
    yield from (load(path, TaskConfig) for path in files.values())
    yield from (standard_task(spec) for name, spec in known_maps().items() if name not in files)


def load_task(name: str) -> TaskConfig:
    """Return the task of this name, or of the file at this path.

    Raises:
        ConfigError: there is no such task, or the file is wrong; the text says what and where.
    """
    files = {path.stem: path for path in task_files()}
    if name.endswith((".yaml", ".yml")):
        return load(name, TaskConfig, shipped=files)
    if name in files:
        return load(files[name], TaskConfig)
    if name in known_maps():
        return standard_task(known_maps()[name])
    close = difflib.get_close_matches(name, {*files, *known_maps()}, n=3)
    hint = f"did you mean {', '.join(close)}? " if close else ""
    raise ConfigError(f"there is no task {name!r}: {hint}`khala tasks` lists all; a path to a .yaml file works too")


def change(task: TaskConfig, **changes: Any) -> TaskConfig:
    """Return the task with fields replaced. None changes nothing.

    `rule`, `max_wait_s` and other fields of `Clock` are those of its clock, `images` are the images of all agents, of
    every side, see `images_for`; what `memory` says holds for all of them, and the rest stays. `level` is the number of
    the computer's difficulty, from 1 to 10.

    Raises:
        ConfigError: a value does not fit.
    """
    given = {name: value for name, value in changes.items() if value is not None}
    fields = task.model_dump()
    for name in Clock.model_fields:
        if name in given:
            fields["clock"][name] = given.pop(name)
    try:
        agents = [agent for side in (fields, *fields["sides"]) for agent in side["agents"] or ()]
        if "images" in given:
            asked = given.pop("images")
            for agent in agents:
                agent["images"] = images_for(asked, agent["kind"])
        if "memory" in given:
            rule = MemoryRule.model_validate(given.pop("memory")).model_dump(exclude_unset=True)
            for part in (fields, *fields["sides"], *agents):
                if part["memory"] is not None:
                    part["memory"] |= rule
        if "level" in given:
            level = get_args(Difficulty)[given.pop("level") - 1]
            given["opponent"] = _fields_of(given.get("opponent", fields["opponent"])) | {"difficulty": level}
        return TaskConfig.model_validate(fields | given)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(map(str, first["loc"]))
        raise ConfigError(f"{place}: {words_of(first)}" if place else words_of(first), source="command line") from None


def _fields_of(opponent: str | dict[str, Any]) -> dict[str, Any]:
    try:
        return opponent_of(opponent) if isinstance(opponent, str) else opponent
    except ValueError as error:
        raise ConfigError(f"opponent: {error}", source="command line") from None


def new_run_name(task: str) -> str:
    """Return a unique name for a run: the task, the time, four random digits."""
    now = datetime.now(UTC).strftime("%Y%m%d-%H%M%S")
    return check_name(f"{task[:40]}-{now}-{secrets.token_hex(2)}", "run")
