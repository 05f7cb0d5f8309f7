"""The configuration of agents: model files, and files that say which agent uses which model or policy.

Model files are found by name in `configs/models/`, or by path. A file never holds a key: it names
the environment variable that does. `khala_agents.build` makes clients and policies of what is read here.
"""

from __future__ import annotations

import difflib
import re
from pathlib import Path
from typing import Annotated, ClassVar, Self

from pydantic import Field, JsonValue, field_validator, model_validator

from khala_agents.answers.form import AnswerForm, AnswerRule
from khala_agents.detail import Detail  # noqa: TC001  # pydantic evaluates it
from khala_agents.llm.address import checked_address
from khala_agents.llm.breaker import BreakerRule
from khala_agents.llm.effort import Effort  # noqa: TC001  # pydantic evaluates it
from khala_agents.llm.limits import LimitRules
from khala_agents.llm.pricing import Prices
from khala_agents.llm.profiles import PROFILES, Profile, ProfileName
from khala_agents.llm.quirks import ALL_LIMITS, SystemRole
from khala_agents.llm.retry import RetryRule
from khala_agents.llm.vision import Vision  # noqa: TC001  # pydantic evaluates it
from khala_configs import CONFIGS
from khala_protocol.configfile import load
from khala_protocol.errors import ConfigError, WrongKey
from khala_protocol.keys import check_name
from khala_protocol.messages import Frozen, MemoryRule, Pace
from khala_protocol.rethinks import MAX_RETHINKS

_VARIABLE = re.compile(r"[A-Z_][A-Z0-9_]*")
_KEY_LIKE = re.compile(r"key|token$|secret|password|authorization|cookie|signature", re.IGNORECASE)
_HEADER = r"^[A-Za-z0-9!#$%&'*+.^_`|~-]{1,100}$"
_SENDABLE = r"^[ -~]{0,1000}$"
_OWN_HEADERS = frozenset({"accept", "accept-encoding", "connection", "content-length", "content-type", "host",
                          "transfer-encoding"})  # fmt: skip
_OWN_FIELDS: dict[str, tuple[JsonValue, str]] = {
    "stream": (False, "Khala reads whole answers"),
    "n": (1, "one answer is read, and all would be billed"),
    "best_of": (1, "one answer is read, and all would be billed"),
    "messages": (None, "Khala writes them"),
    "input": (None, "Khala writes it"),
    "contents": (None, "Khala writes them"),
    "model": (None, "the field `model` of the file names it"),
}
"""Fields of a request body that cannot stand under `extra`, the value that does no harm, and why."""

_OWN_OF_GEMINI = frozenset({"maxOutputTokens", "candidateCount"})


class SentValue(Frozen):
    """What a header or a part of the query has: words, or what an environment variable holds."""

    text: str = Field(default="", pattern=_SENDABLE)
    """The words. `name: words` is short for it."""
    env: str | None = None
    """Name of the environment variable that holds the value, which is treated as a key. With `_FILE` appended, of the
    variable with the path of a file."""
    prefix: str = Field(default="", pattern=_SENDABLE)
    """What is sent in front of the variable's value, such as `"Bearer "`."""

    @model_validator(mode="before")
    @classmethod
    def _short(cls, value: object) -> object:
        return {"text": value} if isinstance(value, str) else value

    @model_validator(mode="after")
    def _words_or_variable(self) -> Self:
        if bool(self.text) == (self.env is not None) or (self.prefix and self.env is None):
            raise ValueError("write text, or {env: NAME} of an environment variable, with or without a prefix")
        if "${" in self.text or (self.env is not None and not _VARIABLE.fullmatch(self.env)):
            raise ValueError("write the name of an environment variable here, such as {env: GATEWAY_TOKEN}")
        return self


class KeyHeader(Frozen):
    """The header that carries the key."""

    name: str = Field(pattern=_HEADER)
    """`name` alone is short for it."""
    prefix: str = Field(default="", pattern=_SENDABLE)
    """What stands in front of the key, such as `"Bearer "`."""

    @model_validator(mode="before")
    @classmethod
    def _short(cls, value: object) -> object:
        return {"name": value} if isinstance(value, str) else value


class ModelConfig(Frozen):
    """One model at one endpoint."""

    profile: ProfileName
    """The kind of endpoint; `compatible` for one that speaks OpenAI's chat completions and has no row."""
    model: str = Field(min_length=1)
    """As the endpoint calls it."""
    retired: str = ""
    """When its provider ends it or has ended it, and its successor: `on 2026-10-23; …`. Empty while it is served."""
    base_url: str
    """Usually ends in `/v1`."""
    base_url_env: str | None = None
    """Name of the environment variable that replaces `base_url` where it is set."""
    api_key_env: str | None = None
    """Name of the environment variable with the key; with `_FILE` appended, of the variable with the path of a file."""
    key_header: KeyHeader | None = None
    """The header that carries the key: `api-key` for Azure, or `{name: Authorization, prefix: "Token "}`; None: as
    endpoints of this kind want it."""
    headers: dict[str, SentValue] = Field(default_factory=dict)
    """Sent with each request: words, or `{env: NAME}` for what an environment variable holds."""
    query: dict[str, SentValue] = Field(default_factory=dict)
    """Added to the address of each request, such as `api-version`; values as in `headers`."""
    system_role: SystemRole | None = None
    """Role of the system message; `fold` puts it in front of the first message of the user. None: as the profile says.
    Where an endpoint refuses one, Khala finds the next by itself."""
    answer: AnswerRule = AnswerRule()
    """The form of its answers: `text`, `json`, `tools` or `grammar`, or `{form: json, exact: false}` for a schema that
    is the same in all steps."""
    max_tokens: int | None = Field(default=None, ge=1)
    """Limit of generated tokens."""
    context: int | None = Field(default=None, ge=256)
    """Tokens of prompt and answer together that the model, as its server has loaded it, can hold: longer prompts are
    shortened. None: as the endpoint says, which many do only when they refuse a prompt."""
    detail: Detail = "full"
    """How much its prompts say: `short` ones have at most about 2 000 tokens and `tiny` ones 1 000, at four characters
    a token, whatever is to be left out for that; a small model reads `tiny` ones best."""
    temperature: float | None = Field(default=None, ge=0)
    seed: int | None = None
    stop: tuple[Annotated[str, Field(min_length=1)], ...] = ()
    """Texts that end an answer where the model writes them; they are not part of it."""
    reasoning_effort: Effort | None = None
    """How much the model thinks; each model takes some of the words. None: as much as it does by default."""
    extra: dict[str, JsonValue] = Field(default_factory=dict)
    """Fields of the request body, as they are."""
    batch: bool = False
    """Whether requests wait for a batch, at half of the `prices`: OpenAI and Anthropic answer most within an hour and
    all within a day. For clocks on which the game stands still, with a wait of an hour or more for each step."""
    try_timeout_s: float | None = Field(default=None, gt=0)
    """Time for one try; the time to the step's deadline if that is shorter. None: half of what the step gives, at least
    45 s, so that a slow model answers and a lost request is made again; 10 minutes without a deadline."""
    retry: RetryRule = RetryRule()
    limits: LimitRules = LimitRules()
    breaker: BreakerRule = BreakerRule()
    prices: Prices = Prices()
    pace: Pace | None = None
    """How fast it reads and writes: what its decisions cost with the clock `token`; None: the task says."""
    images: Vision | None = None
    """Whether the model sees: `true`, or how finely it looks and how its pictures are counted. A model that does not
    see is sent no pictures."""

    @field_validator("images", mode="before")
    @classmethod
    def _sees(cls, value: object) -> object:
        return {} if value is True else None if value is False else value

    @field_validator("base_url")
    @classmethod
    def _address(cls, value: str) -> str:
        return checked_address(value)

    @field_validator("base_url_env")
    @classmethod
    def _address_variable(cls, value: str | None) -> str | None:
        if value is not None and not _VARIABLE.fullmatch(value):
            raise ValueError("write the name of an environment variable here, such as VLLM_BASE_URL")
        return value

    @field_validator("api_key_env", mode="before")
    @classmethod
    def _variable(cls, value: object) -> object:
        if isinstance(value, str) and not _VARIABLE.fullmatch(value):  # not quoted: it may be the key itself
            raise ValueError("write the name of an environment variable here, such as OPENAI_API_KEY, not a key")
        return value

    @field_validator("extra")
    @classmethod
    def _no_keys(cls, value: dict[str, JsonValue]) -> dict[str, JsonValue]:
        for name, sent in value.items():
            if _KEY_LIKE.search(name):
                raise ValueError(f"'{name}' looks like a key, and extra fields are recorded: use api_key_env")
            if name in ALL_LIMITS and not (isinstance(sent, int) and sent > 0):
                raise ValueError(f"'{name}' must be a number of tokens above 0: it limits what an answer may cost")
            if name == "generationConfig" and isinstance(sent, dict) and (own := sorted(_OWN_OF_GEMINI & sent.keys())):
                raise ValueError(f"'{own[0]}' cannot be sent: Khala asks for one answer, of max_tokens at most")
            if name in _OWN_FIELDS and sent != _OWN_FIELDS[name][0]:
                raise ValueError(f"'{name}' cannot be sent: {_OWN_FIELDS[name][1]}")
        return value

    @field_validator("headers", "query")
    @classmethod
    def _no_open_keys(cls, value: dict[str, SentValue]) -> dict[str, SentValue]:
        for name, sent in value.items():
            if _KEY_LIKE.search(name) and sent.env is None:
                raise ValueError(f"'{name}' looks like a key; keep it in a variable and write {{env: NAME}}")
        return value

    @field_validator("headers")
    @classmethod
    def _header_names(cls, value: dict[str, SentValue]) -> dict[str, SentValue]:
        for name in value:
            if not re.fullmatch(_HEADER, name) or name.lower() in _OWN_HEADERS:
                raise ValueError(f"'{name}' is a header that cannot be set here")
        return value

    @model_validator(mode="after")
    def _has_what_it_needs(self) -> Self:
        row = self.row
        if row.needs_key and self.api_key_env is None:
            raise ValueError(f"{self.profile} needs a key: name the environment variable that holds it in api_key_env")
        if self.answer.form not in self.forms:
            takers = " and ".join(name for name, profile in PROFILES.items() if profile.grammar_field)
            raise ValueError(f"{self.profile} takes no grammar: {takers} do; write `answer: json` or `answer: tools`")
        if self.system_role is not None and self.system_role not in row.system_roles:
            roles = " or ".join(row.system_roles)
            raise ValueError(f"{self.profile} has a field for the system message: {_instead('system_role', roles)}")
        if self.batch and not row.batch:
            takers = ", ".join(name for name, profile in PROFILES.items() if profile.batch)
            raise ValueError(f"{self.profile} takes no batches: {takers} do")
        if self.batch and self.limits != LimitRules():
            raise ValueError("a batch has all requests at once: remove limits")
        if self.stop and not row.stop:
            raise ValueError(f"{self.profile} takes no stop: remove it")
        if self.context is not None and self.max_tokens is not None and self.max_tokens >= self.context:
            raise ValueError(
                f"an answer of {self.max_tokens} tokens leaves no room for a prompt in a context of {self.context}: "
                "lower max_tokens, or give the model a larger context"
            )
        return self

    @property
    def row(self) -> Profile:
        """The particulars of its kind of endpoint."""
        return PROFILES[self.profile]

    @property
    def forms(self) -> tuple[AnswerForm, ...]:
        """The forms that its endpoint can hold an answer to."""
        return ("text", "json", "tools", "grammar") if self.row.grammar_field else ("text", "json", "tools")

    @property
    def secrets(self) -> tuple[str, ...]:
        """Names of the environment variables that hold what nobody else may read."""
        sent = [value.env for value in (*self.headers.values(), *self.query.values())]
        return tuple(name for name in (self.api_key_env, *sent) if name)

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of all environment variables that a client of this model reads."""
        files = (f"{name}_FILE" for name in self.secrets)
        return (*self.secrets, *files, *filter(None, [self.base_url_env]))

    def with_model(self, model: str) -> ModelConfig:
        """Return the same endpoint with another model, whose price its file does not know."""
        if model == self.model:
            return self
        prices = self.prices if self.profile == "scripted" else Prices()
        return self.model_copy(update={"model": model, "prices": prices, "retired": ""})

    @property
    def vision(self) -> Vision | None:
        """How the model sees, with a rule to count pictures by; None if it does not see."""
        return self.images.counted_by(self.row.image_tokens) if self.images else None


def _instead(field: str, values: str) -> str:
    return f"{field} is {values}" if values else f"remove {field}"


class WorkerSpec(Frozen):
    """How one agent decides: with a model or with a policy."""

    model: str | None = None
    """Name of a shipped model file, that name with a model (`openai/gpt-5`), or path of a model file, relative to the
    file that names it."""
    policy: str | None = None
    """`silent`, the name of a scripted player, or `module:name` of a function or a policy."""
    fallback: str | None = None
    """A policy, named as in `policy`, that decides where the model has no reply because its endpoint is away, the money
    is used up or the time is over. With a model only."""
    memory: MemoryRule | None = None
    """What its prompt has of the steps before, instead of what the task says: `2`, or `steps`, `whole` and `summary`.
    With a model only; `notes` and `messages_s` are for the host to keep, and stand in the task file."""
    rethink: int = Field(default=0, ge=0, le=MAX_RETHINKS)
    """How often the model is asked again in a step, with the refusals, if nothing of its answer is possible: nothing
    can be read, or every call is refused. It has no more time for it. With a model only."""

    @field_validator("memory")
    @classmethod
    def _of_the_agent(cls, rule: MemoryRule | None) -> MemoryRule | None:
        if rule is not None and (kept := rule.model_fields_set & {"notes", "messages_s"}):
            raise ValueError(
                f"the host keeps {' and '.join(sorted(kept))}: say it in the task file, or to `khala host`"
            )
        return rule

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        if (self.model is None) == (self.policy is None):
            raise ValueError("give either a model or a policy")
        if self.fallback is not None and self.model is None:
            raise ValueError("fallback is for an agent with a model; this one has a policy")
        if self.rethink and self.model is None:
            raise ValueError("rethink is for an agent with a model; this one has a policy")
        return self


class AgentsFile(Frozen):
    """A file that says how each of its agents decides."""

    ELSEWHERE: ClassVar[dict[str, str]] = {"default_reply": "belongs in the task file: the host says it for all agents"}

    agents: dict[str, WorkerSpec] = Field(min_length=1)
    """By name of the agent."""
    budget_usd: float | None = Field(default=None, gt=0)
    """What all of them may spend together; after that, the host takes the default reply of the task for them."""

    @field_validator("agents")
    @classmethod
    def _names(cls, value: dict[str, WorkerSpec]) -> dict[str, WorkerSpec]:
        for name in value:
            try:
                check_name(name, "agent")
            except WrongKey as error:
                raise ValueError(str(error)) from None
        return value


def model_files() -> dict[str, Path]:
    """Return the shipped model files by name."""
    return {path.stem: path for path in sorted((CONFIGS / "models").glob("*.yaml"))}


def load_model(name: str, *, relative_to: Path | None = None) -> ModelConfig:
    """Return the model file of this name, or at this path, or `openai/gpt-5`: a shipped file with another model.

    The prices of a file are those of its own model; another one has its list price.

    Raises:
        ConfigError: there is no such file, or it is wrong; the text says what and where.
    """
    if name.endswith((".yaml", ".yml")):
        return load((relative_to or Path()) / name, ModelConfig)
    files = model_files()
    provider, slash, model = name.partition("/")
    if provider not in files:
        close = difflib.get_close_matches(provider, files, n=1)
        hint = f"did you mean {close[0]}{slash}{model}?" if close else f"there are {', '.join(files)}"
        raise ConfigError(
            f"there is no model file '{provider}': {hint}; write openai, openai/gpt-5, or the path of a .yaml file"
        )
    if slash and not model:
        raise ConfigError(f"'{name}' names no model: write {provider}, or the model as well, such as openai/gpt-5")
    file = load(files[provider], ModelConfig)
    return file.with_model(model) if model else file


def load_agents(path: Path) -> AgentsFile:
    """Return the file at `path`, with the paths of its model files made relative to the current directory.

    Raises:
        ConfigError: there is no such file, or it is wrong; the text says what and where.
    """
    file = load(path, AgentsFile)
    specs = {
        name: spec.model_copy(update={"model": str(path.parent / spec.model)})
        if spec.model and spec.model.endswith((".yaml", ".yml"))
        else spec
        for name, spec in file.agents.items()
    }
    return file.model_copy(update={"agents": specs})
