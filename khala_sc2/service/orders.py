"""From an order to a match that can be played: all that `khala run` checks, and what a machine must not do for others.

A policy, a section of a task and a model file are code or files of this machine, and a base URL is an address to which
it would send a model's key. Who orders a match is somewhere else, so these need `khala serve --trust`.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

from pydantic import TypeAdapter, ValidationError

from khala_bridge.observe import Observer
from khala_bridge.task.code import code_of
from khala_orchestrator.config import MatchConfig
from khala_protocol.configfile import words_of
from khala_protocol.errors import ConfigError
from khala_protocol.keys import check_name
from khala_protocol.trust import check_trusted
from khala_sc2.playing.matches import free_recording, resume_match
from khala_sc2.playing.minds import Minds, groups_of, minds_of

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from khala_protocol.service import Submit

_MINDS = TypeAdapter(Minds)
ASSEMBLE_S = 60.0
"""How long a resumed match waits for its agents."""


def match_of(order: Submit, out: Path, *, trusts: bool) -> tuple[MatchConfig, dict[str, Minds]]:
    """Return the match that an order describes, recorded below `out`, and how the agents of each side decide.

    Raises:
        KhalaError: it cannot be played, or needs more trust than there is; the text says why.
    """
    check_name(order.run, "run")
    try:
        config = _resume(order.run, out) if order.resume else _new(order)
        common = _MINDS.validate_python(order.minds)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        raise ConfigError(f"{'.'.join(map(str, first['loc']))}: {words_of(first)}", source="match") from None
    if unknown := sorted(order.minds.keys() - {field.name for field in dataclasses.fields(Minds)}):
        raise ConfigError(f"there is no option {unknown[0]!r}; does the service have the same version?", source="match")
    minds = minds_of([side.side for side in config.task.per_side()], common, order.sides)
    alike = [mind for _, mind, _ in groups_of(config.task, minds)]
    needs = (what for mind in alike for what in _needs_trust(config, mind))
    if not trusts and (asked := next(needs, None)):
        raise ConfigError(f"{asked} is for a service that was started with --trust: this machine would run or call it")
    check_trusted(code_of(config.task))
    for side in config.task.per_side():
        Observer(side)
    for mind in alike:
        mind.check(config.task.clock)
    return config.model_copy(update={"record": free_recording(out / order.run)}), minds


def _new(order: Submit) -> MatchConfig:
    return MatchConfig.model_validate({**order.match, "run": order.run, "record": None})


def _resume(run: str, out: Path) -> MatchConfig:
    """Return the match of the newest recording of a run."""
    if not (out / run).is_dir():
        raise ConfigError(f"the service has no run {run!r} to resume: it looks for its recording in {out / run}")
    config, _ = resume_match(out / run, out, assemble_s=ASSEMBLE_S)
    if config.run != run:
        raise ConfigError(f"the recording in {out / run} is of the run {config.run!r}: give its directory that name")
    return config


def _needs_trust(config: MatchConfig, minds: Minds) -> Iterator[str]:
    """Yield what this machine would run or call for the match."""
    if minds.base_url is not None:
        yield "--base-url"
    if minds.model.endswith((".yaml", ".yml")):
        yield "a model file"
    for code in (*minds.code(), *code_of(config.task)):
        yield f"the code {code!r}"
