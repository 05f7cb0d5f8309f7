"""Configuration → clients and policies: the one module of this package that knows all its parts.

What a process shares is shared here: agents with the same model file share the limits of its endpoint, and all
agents share the budget. Each agent has its own client, and so its own connection.
"""

from __future__ import annotations

import logging
import os
from functools import cache, partial
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from khala_agents.answers.form import AnswerRule
from khala_agents.batch_policy import LONGEST_BATCH_S, BatchPolicy
from khala_agents.config import ModelConfig, WorkerSpec, load_model
from khala_agents.fallback import Fallback
from khala_agents.llm.address import sends_openly
from khala_agents.llm.anthropic import Anthropic
from khala_agents.llm.breaker import Breaker
from khala_agents.llm.gemini import Gemini
from khala_agents.llm.limits import LONGEST_ANSWER, RequestLimits, own_turns
from khala_agents.llm.money import SharedBudget
from khala_agents.llm.openai_compatible import OpenAICompatible
from khala_agents.llm.pricing import Prices, check_priced, price_of
from khala_agents.llm.replay import ReplayClient
from khala_agents.llm.responses import Responses
from khala_agents.llm.retry import RetryRule
from khala_agents.llm.vision import Vision
from khala_agents.llm.window import ContextWindow, RecordedWindow, told_context
from khala_agents.llm_policy import LLMPolicy
from khala_agents.policy import Policy, as_policy
from khala_agents.scripted.players import PLAYERS, ScriptedPlayer, Silent
from khala_agents.secret import read_key
from khala_protocol.errors import ConfigError
from khala_protocol.trust import import_trusted

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from khala_agents.config import SentValue
    from khala_agents.llm.asking import HttpClient
    from khala_agents.llm.limits import Gates
    from khala_protocol.messages import MemoryRule, ModelCall


log = logging.getLogger(__name__)


def client_for(config: ModelConfig) -> HttpClient[Any]:
    """Return a client for one agent.

    Raises:
        ConfigError: a key that the model file names is missing, or the environment names a proxy that cannot be used.
    """
    key = read_key(config.api_key_env) if config.api_key_env else None
    if config.secrets and sends_openly(config.base_url):
        names = " and ".join(config.secrets)
        _warn_once(
            f"the key in {names} goes to {config.base_url} unencrypted: everyone on the way can read it; use https://"
        )
    sent: dict[str, Any] = {
        "model": config.model,
        "base_url": config.base_url,
        "prices": config.prices,
        "key": key,
        "headers": {name: _sent(value) for name, value in config.headers.items()},
        "query": {name: _sent(value) for name, value in config.query.items()},
        "temperature": config.temperature,
        "reasoning_effort": config.reasoning_effort,
        "batch": config.batch,
        "extra": config.extra,
    }
    if config.key_header is not None:
        sent["key_header"] = config.key_header.name, config.key_header.prefix
    if config.row.api == "anthropic":
        return Anthropic(max_tokens=config.max_tokens or 1024, stop=config.stop, **sent)
    sent |= {"max_tokens": config.max_tokens, "system_role": config.system_role}
    detail = config.images.detail if config.images else "auto"
    match config.row.api:
        case "gemini":
            return Gemini(config.row, seed=config.seed, stop=config.stop, **sent)
        case "responses":
            return Responses(config.row, detail=detail, **sent)
        case "chat":
            return OpenAICompatible(config.row, seed=config.seed, stop=config.stop, detail=detail, **sent)


def _sent(value: SentValue) -> str:
    return value.prefix + read_key(value.env).get_secret_value() if value.env else value.text


@cache
def _warn_once(sentence: str) -> None:
    log.error("%s", sentence)  # the level that is shown without -v


class Workshop:
    """The maker of the policies of one process.

    Args:
        budget: what all agents of the process may spend together.
        overrides: fields given on the command line; they replace those of every model file.
        gates: where requests wait for their turn, if not with those of this process alone.
    """

    def __init__(
        self,
        *,
        budget: SharedBudget | None = None,
        overrides: Mapping[str, str | float | None] | None = None,
        gates: Gates = own_turns,
    ) -> None:
        self._budget = budget or SharedBudget(None)
        self._overrides = {name: value for name, value in (overrides or {}).items() if value is not None}
        self._gates = gates
        self._models: dict[str, tuple[ModelConfig, RequestLimits]] = {}
        self._windows: dict[str, ContextWindow] = {}
        self._breakers: dict[str, Breaker] = {}

    def policy(self, spec: WorkerSpec) -> Policy:
        """Return the policy of one agent.

        Raises:
            ConfigError: a file, a key or a module is missing or wrong.
        """
        if spec.policy is not None:
            return load_policy(spec.policy)
        assert spec.model is not None
        config, limits = self._model(spec.model)
        client = client_for(config)
        if spec.model not in self._windows:
            told = partial(told_context, config.profile, config.model, client.read)
            self._windows[spec.model] = ContextWindow(config.context, limits.scale, told)
        kind = BatchPolicy if config.batch else LLMPolicy
        model = kind(
            client,
            window=self._windows[spec.model],
            memory=spec.memory,
            retry=config.retry,
            limits=limits,
            try_timeout_s=config.try_timeout_s or (LONGEST_BATCH_S if config.batch else None),
            vision=config.vision,
            pace=config.pace,
            answer=config.answer,
            detail=config.detail,
            rethink=spec.rethink,
            breaker=self._breakers.setdefault(config.base_url, Breaker(config.base_url, config.breaker)),
        )
        return Fallback(model, load_policy(spec.fallback), name=spec.fallback) if spec.fallback else model

    def _model(self, name: str) -> tuple[ModelConfig, RequestLimits]:
        if name not in self._models:
            file = load_model(name)
            config = _change(_with_address(file), self._overrides, source="command line")
            config = config.model_copy(update={"prices": _prices(config, file)})
            if self._budget.limit_usd is not None:
                check_priced(config.prices, config.model, config.base_url)
                config = config.model_copy(update={"max_tokens": config.max_tokens or LONGEST_ANSWER})
            limits = RequestLimits(
                gate=self._gates(f"{config.model} at {config.base_url}", config.limits, f"model file {name}"),
                prices=config.prices,
                budget=self._budget,
            )
            self._models[name] = config, limits
        return self._models[name]


def _with_address(config: ModelConfig) -> ModelConfig:
    """Return the model, at the address from the environment if there is one."""
    variable = config.base_url_env
    address = os.environ.get(variable) if variable else None
    return _change(config, {"base_url": address}, source=variable) if address else config


def _prices(config: ModelConfig, file: ModelConfig) -> Prices:
    """Return the prices of a model: those of its file if it is the model of the file, or else the list price."""
    is_of_the_file = config.model == file.model or config.profile == "scripted"  # all of whose players are free
    prices = config.prices if is_of_the_file and config.prices.known else price_of(config.model, config.base_url)
    return prices.in_batch if config.batch else prices


def _change(config: ModelConfig, changes: Mapping[str, str | float | None], *, source: str | None) -> ModelConfig:
    try:
        return ModelConfig.model_validate({**config.model_dump(), **changes})
    except ValidationError as error:
        fault = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in fault["loc"])
        raise ConfigError(fault["msg"].removeprefix("Value error, "), source=source, field=field) from None


def replay_policies(exchanges: Iterable[ModelCall], *, memory: MemoryRule | None = None) -> dict[str, LLMPolicy]:
    """Return a policy for each agent that made the recorded requests; it gets the recorded answers without waiting.

    Args:
        exchanges: of one run, in any order.
        memory: as the recorded agents had it of their own; None: as the task said.
    """
    by_agent: dict[str, list[ModelCall]] = {}
    for exchange in exchanges:
        by_agent.setdefault(exchange.agent, []).append(exchange)
    at_once = RetryRule(tries=1000, base_s=0, cap_s=0, jitter_s=0)
    return {
        agent: LLMPolicy(
            ReplayClient(made),
            memory=memory,
            retry=at_once,
            vision=_vision_of(made),
            answer=_answer_of(made),
            window=RecordedWindow(made),
        )
        for agent, made in by_agent.items()
    }


def _answer_of(exchanges: Iterable[ModelCall]) -> AnswerRule:
    """Return the form of the answers to these requests."""
    return AnswerRule(form=next((form for made in exchanges if (form := made.params.get("answer"))), "text"))


def _vision_of(exchanges: Iterable[ModelCall]) -> Vision | None:
    """Return how the model of these requests saw pictures; None if it was shown none."""
    shown = [len(message.images) for exchange in exchanges for message in exchange.prompt]
    return Vision(max_images=max(shown)) if any(shown) else None


def load_policy(name: str) -> Policy:
    """Return the scripted player of this name, or the function, class or policy at `module:name`.

    Modules are also looked for in the current directory.

    Raises:
        ConfigError: there is no such policy, its module is not trusted, or importing it failed.
    """
    if name == "silent":
        return Silent()
    if name in PLAYERS:
        return ScriptedPlayer(name)
    module_name, _, attribute = name.partition(":")
    if not module_name or not attribute:
        raise ConfigError(f"'{name}' is not a policy: write {', '.join(PLAYERS)} or module:name, as my_agent:decide")
    found = load_attribute(module_name, attribute, source=f"policy {name}")
    try:
        return as_policy(found() if isinstance(found, type) else found)
    except TypeError as error:
        raise ConfigError(str(error), source=f"policy {name}") from None


def load_attribute(module_name: str, attribute: str, *, source: str) -> Any:
    """Return what the user's module has under a name. It is also looked for in the current directory.

    Args:
        module_name: of the module.
        attribute: the name.
        source: for errors, what wants it.

    Raises:
        ConfigError: there is no such module or name, it is not trusted, or importing it failed.
    """
    module = import_trusted(module_name, source=source)
    found = getattr(module, attribute, None)
    if found is None:
        raise ConfigError(f"the module {module_name} has no '{attribute}'", source=source)
    return found
