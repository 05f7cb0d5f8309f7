"""How the agents of a local match decide: with which model or policy, at which address, for how much money.

`khala_sc2.playing.local` is above; it starts agents that decide so. In a match of two sides each may have its own.
"""

from __future__ import annotations

import os
from collections.abc import Mapping  # noqa: TC003  # pydantic evaluates it, in `khala_sc2.service`
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from khala_agents.answers.form import AnswerForm  # noqa: TC001  # pydantic evaluates it, too
from khala_agents.batch_policy import reason_against_batches
from khala_agents.build import Workshop
from khala_agents.config import WorkerSpec, load_agents, load_model, model_files
from khala_agents.llm.limits import own_turns
from khala_agents.llm.money import SharedBudget
from khala_agents.scripted.players import PLAYERS
from khala_orchestrator.roster import Seat
from khala_protocol.errors import ConfigError
from khala_protocol.trust import check_keys, check_trusted, module_of, trust_named
from khala_sc2.playing import environment

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence
    from contextlib import AsyncExitStack
    from pathlib import Path

    from khala_agents.llm.limits import Gates
    from khala_agents.policy import Policy
    from khala_bridge.task.config import TaskConfig
    from khala_orchestrator.config import MatchConfig
    from khala_protocol.messages import Clock

SCRIPTED = "scripted"
"""The model whose endpoint is started along with a match."""
SILENT = "silent"


@dataclass(frozen=True, slots=True)
class Minds:
    """How the agents of a side decide; see `khala agent --help`."""

    model: str = SCRIPTED
    model_name: str | None = None
    base_url: str | None = None
    policy: str | None = None
    budget_usd: float | None = None
    latency_s: float = 0.0
    """Latency of the scripted endpoint, if it is started."""
    fallback: str | None = None
    """Policy that decides where the model has no reply."""
    rethink: int = 0
    """How often the model is asked again in a step, if nothing of its answer is possible."""
    answer: AnswerForm | None = None
    """Form of the model's answers, instead of the one in its file."""
    agents: Mapping[str, str] = field(default_factory=dict)
    """Agents that decide in another way, by name, as `named` takes it."""

    def groups(self, names: Sequence[str]) -> list[tuple[Minds, list[str]]]:
        """Return the agents in groups that decide alike, in the order of their names.

        Raises:
            ConfigError: one that decides in another way is not among them.
        """
        if unknown := sorted(self.agents.keys() - set(names)):
            raise ConfigError(f"there is no agent {unknown[0]!r}: the agents are {', '.join(names)}")
        said = {name: self.agents.get(name) for name in names}
        alone = replace(self, agents={})
        return [
            (alone if text is None else alone.with_name(text), [name for name in names if said[name] == text])
            for text in dict.fromkeys(said.values())
        ]

    def with_name(self, text: str) -> Minds:
        """Return minds with the model or the policy of this name; budget, latency, fallback and rethink stay.

        Args:
            text: a model, a model and its name at the endpoint (`scripted/skilled`), or a policy (`my_agent:decide`).
        """
        if text == SILENT or text in PLAYERS or ":" in text.partition("/")[0]:
            return replace(self, policy=text, base_url=None)
        if text.endswith((".yaml", ".yml")):
            return replace(self, model=text, model_name=None, base_url=None, policy=None)
        model, _, name = text.partition("/")
        return replace(self, model=model, model_name=name or None, base_url=None, policy=None)

    @property
    def full_name(self) -> str:
        """The model file, with the model that is asked for instead of the one of the file: `openai/gpt-5`."""
        return f"{self.model}/{self.model_name}" if self.model_name else self.model

    def code(self) -> Iterator[str]:
        """Yield the modules of policies that it names; those of single agents are in groups of their own."""
        yield from filter(None, (module_of(name) for name in (self.policy, self.fallback) if name))

    def keys_sent(self) -> Iterator[str]:
        """Yield the keys that its model would be sent to an address that no shipped model file gives for them.

        `OPENAI_API_KEY to llm.example.org`: a file that names an address, or a model file, may be anyone's.
        """
        if self.policy is not None:
            return
        file = load_model(self.model)
        host = urlsplit(self.base_url or file.base_url).hostname or ""
        shipped = {(model.api_key_env, urlsplit(model.base_url).hostname) for model in map(load_model, model_files())}
        if file.api_key_env and (file.api_key_env, host) not in shipped:
            yield f"{file.api_key_env} to {host}"

    @property
    def asks_a_model(self) -> bool:
        """Whether any of its agents does, and so may spend money."""
        return any(mind.policy is None for mind in (self, *map(self.with_name, self.agents.values())))

    def check(self, clock: Clock | None = None) -> None:
        """Check that an agent could decide this way, before anything is started.

        Args:
            clock: of the match, if it is known.

        Raises:
            ConfigError: a model file, a key or a policy is missing or wrong, or the match is too fast for the model.
        """
        self.policies([""], self.base_url, SharedBudget(self.budget_usd))
        in_batches = self.policy is None and load_model(self.model).batch
        if clock is not None and in_batches and (why := reason_against_batches(clock)):
            raise ConfigError(why, source=self.model)

    def policies(
        self, names: Sequence[str], base_url: str | None, budget: SharedBudget, gates: Gates = own_turns
    ) -> dict[str, Policy]:
        """Return a policy for each agent, for agents in this process.

        Args:
            names: of the agents.
            base_url: of the scripted endpoint, where it is needed.
            budget: of all agents of the side.
            gates: where requests to models wait for their turn.

        Raises:
            ConfigError: as in `check`.
        """
        if self.policy:
            spec = WorkerSpec(policy=self.policy)
        else:
            spec = WorkerSpec(model=self.model, fallback=self.fallback, rethink=self.rethink)
        address = base_url if self.needs_endpoint else self.base_url
        workshop = Workshop(budget=budget, overrides=self._overrides(address), gates=gates)
        return {name: workshop.policy(spec) for name in names}

    def _overrides(self, address: str | None) -> dict[str, str | float | None]:
        return {"model": self.model_name, "base_url": address, "answer": self.answer}

    @property
    def environ(self) -> dict[str, str]:
        """The environment of the agents: all of ours for a policy, which is code of the user, but no keys of a bus."""
        ours = {name: value for name, value in os.environ.items() if name != "KHALA_TLS"}
        return ours if self.policy else environment.with_model(load_model(self.model))

    @property
    def needs_endpoint(self) -> bool:
        """Whether the scripted endpoint is needed."""
        return self.policy is None and self.base_url is None and self.model.partition("/")[0] == SCRIPTED

    def options(self, base_url: str | None) -> list[str]:
        """Return the options of `khala agent` that say this; `base_url` is the scripted endpoint's."""
        if self.policy:
            return ["--policy", self.policy]
        address = base_url if self.needs_endpoint else self.base_url
        more = {"--base-url": address, "--model-name": self.model_name, "--answer": self.answer}
        more |= {"--fallback": self.fallback, "--rethink": str(self.rethink) if self.rethink else None}
        given = [part for option, value in more.items() if value for part in (option, value)]
        return ["--model", self.model, *given]


def groups_of(
    task: TaskConfig, minds: Mapping[str, Minds], *, taken: Collection[Seat] = ()
) -> Iterator[tuple[str, Minds, list[str]]]:
    """Yield the agents of a match in groups that decide alike, each with its side; those `taken` are left out.

    Raises:
        ConfigError: minds name an agent that is not in the task.
    """
    for side in task.per_side():
        names = [agent.name for agent in side.agents]
        left = {name for name in names if Seat(side.side, name) not in taken}
        for mind, group in minds[side.side].groups(names) if left else ():
            if not left.isdisjoint(group):
                yield side.side, mind, [name for name in group if name in left]


def declare_rethink(config: MatchConfig, rethink: Mapping[Seat, int]) -> MatchConfig:
    """Return a match whose run card says which agents may rethink, `red/Zealots` where there are two sides.

    Args:
        config: the match.
        rethink: by agent, how often in a step.
    """
    sides = len(config.task.per_side())
    said = {seat.agent if sides == 1 else str(seat): count for seat, count in rethink.items() if count}
    return config.model_copy(update={"rethink": said})


async def scripted_endpoint(stack: AsyncExitStack, groups: Iterable[tuple[str, Minds, Sequence[str]]]) -> str | None:
    """Serve the scripted model in this process until the stack ends, if one of the groups asks it; return its address.

    It needs a millisecond for an answer. A process of its own would take a second to start, and 68 MB.
    """
    latencies = [mind.latency_s for _, mind, _ in groups if mind.needs_endpoint]
    if not latencies:
        return None
    from khala_agents.scripted.endpoint import Behaviour, Endpoint  # noqa: PLC0415  # aiohttp's server, only for this

    endpoint = await stack.enter_async_context(Endpoint(Behaviour(latency_s=latencies[0])))
    return endpoint.base_url


def minds_of(sides: Sequence[str], common: Minds, named: Mapping[str, str]) -> dict[str, Minds]:
    """Return the minds of each side; those that ask a model may spend the same part of the budget.

    Args:
        sides: names of the sides of the task.
        common: minds of every side that has none of its own.
        named: by side, what `Minds.named` takes.

    Raises:
        ConfigError: there is no such side.
    """
    if unknown := [side for side in named if side not in sides]:
        is_it = f"its sides are {' and '.join(sides)}" if len(sides) > 1 else f"its only side is {sides[0]}"
        raise ConfigError(f"the task has no side {unknown[0]}: {is_it}")
    made = {side: common.with_name(named[side]) if side in named else common for side in sides}
    return made if common.budget_usd is None else share_budget(made, common.budget_usd)


def share_budget(minds: Mapping[str, Minds], usd: float) -> dict[str, Minds]:
    """Return the minds of each side with its budget: those that ask a model may spend the same part."""
    asking = sum(mind.asks_a_model for mind in minds.values())
    return {side: replace(mind, budget_usd=usd / asking if mind.asks_a_model else usd) for side, mind in minds.items()}


def trust_options(common: Minds, sides: Mapping[str, str]) -> None:
    """Trust the code that the user has named in options: of all sides, and of single ones or of single agents."""
    trust_named(common.policy, common.fallback, *common.agents.values(), *sides.values())


def agents_of(path: Path) -> tuple[dict[str, str], float | None]:
    """Return how the agents of a file decide, as `Minds.agents` takes it, and what all of them may spend.

    Raises:
        ConfigError: the file is wrong, it says what `khala run` says for all agents, or it names code or an address for
            keys that the user does not trust.
    """
    file = load_agents(path)
    for name, spec in file.agents.items():
        if others := [field for field in ("memory", "fallback", "rethink") if getattr(spec, field)]:
            option = " and ".join(f"--{field}" for field in others)
            raise ConfigError(
                f"{name}: here {option} holds for all agents: give it as an option and leave it out of the file, or "
                "play with `khala host` and `khala agent --agents`",
                source=str(path),
            )
    texts = {name: spec.policy or spec.model or SCRIPTED for name, spec in file.agents.items()}
    check_trusted(filter(None, map(module_of, (spec.policy or "" for spec in file.agents.values()))), source=str(path))
    for text in texts.values():
        check_keys(Minds().with_name(text).keys_sent())
    return texts, file.budget_usd


def named_sides(pairs: Sequence[str], **others: str | None) -> dict[str, str]:
    """Return by side what `NAME=MODEL` says of it, and what `others` say of sides that they name.

    Raises:
        ConfigError: one is not written so.
    """
    split = [pair.partition("=") for pair in pairs]
    for name, equals, text in split:
        if not (name and equals and text):
            raise ConfigError(
                f"'{name}{equals}{text}' does not name a side and its model: write red=openai", source="--side-model"
            )
    return {name: text for name, _, text in split} | {name: text for name, text in others.items() if text}
