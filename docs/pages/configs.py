"""The pages of the files that a user writes: tasks, models, agents. Made from their models and the shipped files."""

from __future__ import annotations

import inspect
from dataclasses import fields
from typing import TYPE_CHECKING

from docs.pages.markdown import code, fence, head, join, prose, table
from docs.pages.schema import Describer, about, parts
from khala_agents.config import AgentsFile, ModelConfig, load_model, model_files
from khala_agents.fitting import CUTS
from khala_agents.llm.profiles import PROFILES, Profile
from khala_bridge.state import teams
from khala_bridge.task import config
from khala_configs import CONFIGS

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from pydantic import BaseModel

NAMES: dict[object, str] = {
    config.KeyName: "name",
    config.UnitTypeName: "[unit type](units.md)",
    config.ActionName: "[action](actions.md)",
    config.MapName: "[map](maps.md)",
}
"""Names that are checked while a file is read; the first one may be part of a key of the bus."""
DESCRIBER = Describer(NAMES)


def task_files() -> str:
    """Return the page of task files."""
    example = CONFIGS / "tasks" / "llm_smac" / "2s3z_pair.yaml"
    return join(
        head("Task files", "the models in `bridge/khala_bridge/task/config.py`"),
        "YAML. A path to such a file can be given wherever a task is named; the shipped ones are [listed](tasks.md). "
        "A mistake is reported with file, line and field. A name has 1 to 64 letters, digits, `_`, `.` or `-`.",
        "Of the rules of the clock, `frozen` is the only one that is played so far.",
        *_sections(config.TaskConfig, "##"),
        "## Which unit belongs to which team",
        _grouping(),
        "## Example",
        *_file(example, "yaml task"),
    )


def model_files_page() -> str:
    """Return the page of model files and files of agents, the shipped ones, and the profiles' differences."""
    return join(
        head(
            "Model files and agents files", "the models in `agents/khala_agents/config.py` and the files in `configs/`"
        ),
        "YAML. A model is given by the name of a shipped file or by a path that ends in `.yaml`. No file holds a key: "
        "it names the environment variable that does.",
        "## Shipped models",
        _shipped(),
        "## Model files",
        *_sections(ModelConfig, "###"),
        "### Example",
        *_file(model_files()["openai"], "yaml model"),
        "## What is left out of a prompt that is too long",
        "A prompt that would not fit the model's context, with `max_tokens` for the answer, is made shorter in this "
        "order until it fits. The rest of a prompt always stays.",
        table(("part", "why it can go"), [(cut.name, cut.reason) for cut in CUTS]),
        "## Agents files",
        "`khala agent --agents FILE` plays agents that decide in different ways in one process.",
        *_sections(AgentsFile, "###"),
        "### Example of an agents file",
        *_file(CONFIGS / "agents" / "mixed.yaml", "yaml agents"),
        "## Profiles",
        _profiles(),
    )


def _sections(model: type[BaseModel], level: str) -> Iterator[str]:
    """Yield a section for a model, and one for each of its parts."""
    for each in [model, *parts([model])]:
        yield join(f"{level} {each.__name__}", about(each), DESCRIBER.fields(each))


def _file(path: Path, language: str) -> tuple[str, str]:
    return f"`{path.relative_to(CONFIGS.parent).as_posix()}`:", fence(path.read_text(encoding="utf-8"), language)


def _grouping() -> str:
    """Return the rules of `khala_bridge.state.teams`, without its title and its sources."""
    _, *paragraphs = (inspect.getdoc(teams) or "").split("\n\n")
    return prose("\n\n".join(text for text in paragraphs if not text.startswith("The head")))


def _shipped() -> str:
    rows = []
    for name in model_files():
        model = load_model(name)
        prices = f"{model.prices.prompt:g} / {model.prices.completion:g}" if model.prices.known else "not given"
        place = (code(model.model), code(model.base_url), *_variables(model))
        rows.append((code(name), model.profile, *place, prices, model.retired))
    money = "USD per million tokens, in / out"
    return table(("name", "profile", "model", "base URL", "or at", "key in", money, "retired"), rows)


def _variables(model: ModelConfig) -> tuple[str, ...]:
    return tuple(code(name) if name else "" for name in (model.base_url_env, model.api_key_env))


def _profiles() -> str:
    names = [field.name for field in fields(Profile)]
    rows = [(code(name), *(_said(field, getattr(row, field)) for field in names)) for name, row in PROFILES.items()]
    attributes = (inspect.getdoc(Profile) or "").partition("Attributes:\n")[2]
    meanings = [line.strip().split(": ", 1) for line in attributes.splitlines() if line.strip()]
    return join(
        "What endpoints of one kind must be sent or asked differently.",
        table(("profile", *names), rows),
        table(("column", "meaning"), [(code(name), meaning) for name, meaning in meanings]),
    )


def _said(field: str, value: object) -> str:
    if isinstance(value, tuple):
        return code((", " if field == "system_roles" else ".").join(map(str, value))) if value else ""
    return {True: "yes", False: "no"}[value] if isinstance(value, bool) else code(value)
