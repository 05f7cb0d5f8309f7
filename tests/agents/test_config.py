"""Model files and agent files: shipped files are right, and mistakes are reported."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from khala_agents.build import Workshop, client_for, load_policy
from khala_agents.config import WorkerSpec, load_agents, load_model, model_files
from khala_agents.llm.anthropic import Anthropic
from khala_agents.llm.client import LLMError, Request
from khala_agents.llm.gemini import Gemini
from khala_agents.llm.money import SharedBudget
from khala_agents.llm.openai_compatible import OpenAICompatible
from khala_agents.llm.pricing import price_of
from khala_agents.llm.responses import Responses
from khala_agents.llm_policy import LLMPolicy
from khala_agents.policy import FunctionPolicy, ObjectPolicy
from khala_agents.scripted.canned import Canned, Given
from khala_agents.scripted.players import Silent
from khala_protocol.configfile import loads
from khala_protocol.errors import ConfigError
from khala_protocol.messages import ChatMessage
from khala_protocol.trust import trust_named
from khala_sc2.commands.doctor import keys as keys_found
from khala_sc2.playing.environment import plain, with_model

if TYPE_CHECKING:
    from collections.abc import Iterator

    from khala_agents.llm.asking import HttpClient

from khala_agents.config import AgentsFile, ModelConfig

ROOT = Path(__file__).resolve().parents[2]


OWN_APIS: dict[str, type[HttpClient[Any]]] = {
    "anthropic": Anthropic, "claude3-haiku": Anthropic, "gemini": Gemini, "openai-responses": Responses,
}  # fmt: skip
SHIPPED = [
    "anthropic",
    "azure",
    "claude3-haiku",
    "deepseek",
    "gemini",
    "glm",
    "glm-4-plus",
    "gpt-3.5-turbo",
    "gpt-4o",
    "gpt-4o-mini",
    "gpt-o1-mini",
    "llama3.1-405b",
    "llama3.1-70b",
    "llama3.1-8b",
    "llamacpp",
    "lmstudio",
    "ollama",
    "openai",
    "openai-responses",
    "openrouter",
    "qwen",
    "scripted",
    "vllm",
]


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_model_file_makes_a_client(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    config = load_model(name)
    for variable in config.secrets:
        monkeypatch.setenv(variable, "sk-0123456789")
    client = client_for(config)
    assert type(client) is OWN_APIS.get(name, OpenAICompatible)
    assert (client.model, client.endpoint) == (config.model, config.base_url)


def test_no_shipped_file_of_a_real_model_limits_what_max_wait_gives() -> None:
    limited = {name for name in model_files() if load_model(name).try_timeout_s is not None}
    assert limited == {"scripted"}


def test_a_provider_and_its_model_name_a_model_file_with_another_model() -> None:
    openai, other = load_model("openai"), load_model("openai/gpt-5")
    assert (other.model, other.base_url) == ("gpt-5", openai.base_url)
    assert load_model("vllm/org/llama:8b").model == "org/llama:8b"
    assert not other.prices.known  # it has its own price on the list, or none
    assert load_model("scripted/skilled").prices.known


def test_an_answer_that_fills_the_context_is_a_mistake() -> None:
    with pytest.raises(ValueError, match="leaves no room for a prompt in a context of 1000"):
        ModelConfig(profile="vllm", model="m", base_url="http://x/v1", max_tokens=1000, context=1000)


def test_every_shipped_model_file_is_tried() -> None:
    assert sorted(model_files()) == SHIPPED


def test_a_retired_model_says_since_when_and_its_successor() -> None:
    retired = {name: load_model(name).retired for name in SHIPPED if load_model(name).retired}
    assert set(retired) == {"claude3-haiku", "glm-4-plus", "gpt-3.5-turbo", "gpt-4o", "gpt-4o-mini", "gpt-o1-mini"}
    assert retired["gpt-3.5-turbo"] == "on 2026-10-23; OpenAI named gpt-5.6-terra as its successor"
    assert load_model("gpt-3.5-turbo/gpt-5.6-terra").retired == ""


@pytest.mark.parametrize("name", ["anthropic", "deepseek", "gemini", "glm", "openai", "openai-responses"])
def test_the_price_of_a_shipped_model_is_known_where_its_provider_has_a_list(name: str) -> None:
    config = load_model(name)
    assert price_of(config.model, config.base_url).known


def test_a_key_of_any_shipped_model_file_is_seen_by_the_doctor(monkeypatch: pytest.MonkeyPatch) -> None:
    keys = {key for name in SHIPPED if (key := load_model(name).api_key_env)}
    for key in keys:
        monkeypatch.setenv(key, "sk-0123456789")
    (finding,) = keys_found()
    assert keys == set(finding.found.removesuffix(" set").split(", "))


def test_the_shipped_agents_file_makes_policies() -> None:
    file = load_agents(ROOT / "configs" / "agents" / "mixed.yaml")
    workshop = Workshop(budget=SharedBudget(file.budget_usd))
    policies = {name: workshop.policy(spec) for name, spec in file.agents.items()}
    assert {name: type(policy) for name, policy in policies.items()} == {
        "CombatGroupSmac": LLMPolicy,
        "Watcher": Silent,
    }


def test_a_missing_key_names_its_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    monkeypatch.delenv("OPENAI_API_KEY_FILE", raising=False)
    with pytest.raises(ConfigError) as caught:
        Workshop().policy(WorkerSpec(model="openai"))
    assert str(caught.value) == (
        "no key: set the environment variable OPENAI_API_KEY, or let OPENAI_API_KEY_FILE name a file that holds it"
    )


GOOD = "profile: vllm\nmodel: m\nbase_url: http://h/v1\n"
BAD_MODELS = [
    ("profile: vllm\nmodel: m\n", "m.yaml:1 (base_url): is required and not given"),
    (GOOD.replace("http://h", "h"), "m.yaml:3 (base_url): 'h/v1' is not a URL that begins with http:// or https://"),
    (
        GOOD.replace("h/", "me:sk-secret@h/"),
        ("m.yaml:3 (base_url): a key, a password or a query does not belong in an address: "
        "name a variable in api_key_env, and write a query such as api-version under `query`"),
    ),
    (
        GOOD.replace("/v1", "/v1?key=sk-secret"),
        ("m.yaml:3 (base_url): a key, a password or a query does not belong in an address: "
        "name a variable in api_key_env, and write a query such as api-version under `query`"),
    ),
    (
        GOOD + "api_key_env: sk-secret",
        "m.yaml:4 (api_key_env): write the name of an environment variable here, such as OPENAI_API_KEY, not a key",
    ),
    (
        GOOD + "api_key: sk-secret",
        "m.yaml:4 (api_key): no such field, did you mean 'api_key_env'?",
    ),
    (
        GOOD + "extra:\n  api_key: sk-secret",
        "m.yaml:4 (extra): 'api_key' looks like a key, and extra fields are recorded: use api_key_env",
    ),
    (
        GOOD.replace("vllm", "openai"),
        "m.yaml:1: openai needs a key: name the environment variable that holds it in api_key_env",
    ),
    (GOOD + "extra: {stream: true}", "m.yaml:4 (extra): 'stream' cannot be sent: Khala reads whole answers"),
    (GOOD + "extra: {n: 4}", "m.yaml:4 (extra): 'n' cannot be sent: one answer is read, and all would be billed"),
    (GOOD + "extra: {model: x}", "m.yaml:4 (extra): 'model' cannot be sent: the field `model` of the file names it"),
    (
        GOOD + "headers: {Authorization: Bearer sk-secret}",
        "m.yaml:4 (headers): 'Authorization' looks like a key; keep it in a variable and write {env: NAME}",
    ),
    (
        GOOD + "query: {subscription-key: sk-secret}",
        "m.yaml:4 (query): 'subscription-key' looks like a key; keep it in a variable and write {env: NAME}",
    ),
    (
        GOOD + "headers: {X-Team: '${sk-secret}'}",
        ("m.yaml:4 (headers.X-Team): write the name of an environment variable here, "
        "such as {env: GATEWAY_TOKEN}"),
    ),
    (
        GOOD + "headers: {X-Team: {env: sk-secret}}",
        ("m.yaml:4 (headers.X-Team): write the name of an environment variable here, "
        "such as {env: GATEWAY_TOKEN}"),
    ),
    (
        GOOD + "headers: {X-Team: {prefix: a}}",
        "m.yaml:4 (headers.X-Team): write text, or {env: NAME} of an environment variable, with or without a prefix",
    ),
    (GOOD + "headers: {Host: other}", "m.yaml:4 (headers): 'Host' is a header that cannot be set here"),
    (GOOD + "headers: {'a b': c}", "m.yaml:4 (headers): 'a b' is a header that cannot be set here"),
    (
        GOOD + "system_role: robot",
        "m.yaml:4 (system_role): 'robot' is none of 'system', 'developer', 'user' or 'fold'",
    ),
    (
        GOOD.replace("vllm", "anthropic") + "api_key_env: A\nsystem_role: fold",
        "m.yaml:1: anthropic has a field for the system message: remove system_role",
    ),
    (
        GOOD.replace("vllm", "gemini") + "api_key_env: A\nsystem_role: developer",
        "m.yaml:1: gemini has a field for the system message: system_role is system or fold",
    ),
    (
        GOOD.replace("vllm", "responses") + "api_key_env: A\nstop: [END]",
        "m.yaml:1: responses takes no stop: remove it",
    ),
    (
        GOOD + "batch: true",
        "m.yaml:1: vllm takes no batches: openai, openai-reasoning, responses, anthropic do",
    ),
    (
        GOOD.replace("vllm", "openai") + "api_key_env: A\nbatch: true\nlimits: {in_flight: 4}",
        "m.yaml:1: a batch has all requests at once: remove limits",
    ),
    (GOOD + "stop: ['']", "m.yaml:4 (stop.0): string should have at least 1 character, not ''"),
    (
        GOOD + "reasoning_effort: much",
        "m.yaml:4 (reasoning_effort): 'much' is none of 'none', 'minimal', 'low', 'medium', 'high', 'xhigh' or 'max'",
    ),
    (
        GOOD + "extra: {generationConfig: {candidateCount: 4}}",
        "m.yaml:4 (extra): 'candidateCount' cannot be sent: Khala asks for one answer, of max_tokens at most",
    ),
    (GOOD + "try_timeout_s: 0", "m.yaml:4 (try_timeout_s): input should be greater than 0, not 0"),
    (GOOD + "retry: {tries: 0}", "m.yaml:4 (retry.tries): input should be greater than or equal to 1, not 0"),
    (GOOD + "prices: {promt: 1}", "m.yaml:4 (prices.promt): no such field, did you mean 'prompt'?"),
    (GOOD + "limits:\n  in_flight: many",
     "m.yaml:5 (limits.in_flight): input should be a valid integer, unable to parse string as an integer, not 'many'"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "expected"), BAD_MODELS)
def test_a_wrong_model_file_says_line_and_field_and_never_a_key(text: str, expected: str) -> None:
    with pytest.raises(ConfigError) as caught:
        loads(text, ModelConfig, source="m.yaml")
    assert str(caught.value) == expected
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize("harmless", ["{stream: false}", "{n: 1}"])
def test_what_would_change_nothing_is_taken(harmless: str) -> None:
    assert loads(f"{GOOD}extra: {harmless}", ModelConfig, source="m.yaml").extra


AZURE = """
profile: openai
model: my-deployment
base_url: {base}/openai/deployments/my-deployment/chat/completions
api_key_env: AZURE_KEY
key_header: api-key
headers: {{X-Team: research, X-Gateway: {{env: GATEWAY_TOKEN, prefix: "Token "}}}}
query: {{api-version: "2024-10-21", subscription-key: {{env: SUBSCRIPTION}}}}
max_tokens: 40
"""
SECRETS = {"AZURE_KEY": "azure-0123456789", "GATEWAY_TOKEN": "gateway-0123456789", "SUBSCRIPTION": "sub-0123456789"}


@pytest.mark.parametrize("kind", ["openai", "anthropic"])
async def test_a_gateway_gets_its_headers_its_query_and_its_key(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in SECRETS.items():
        monkeypatch.setenv(name, value)
    answer = Given({"error": {"message": f"no {' '.join(SECRETS.values())}"}}, 404)
    async with Canned(answer) as server:
        config = loads(AZURE.format(base=server.root).replace("openai\n", f"{kind}\n"), ModelConfig, source="m.yaml")
        client = client_for(config)
        with pytest.raises(LLMError) as caught:
            await client.complete(Request((ChatMessage(role="user", content="Game"),), timeout_s=5.0))
        await client.check()
        await client.close()
    for asked in server.asked:
        assert asked.query == {"api-version": "2024-10-21", "subscription-key": SECRETS["SUBSCRIPTION"]}
        assert asked.headers["api-key"] == SECRETS["AZURE_KEY"]
        assert asked.headers["x-team"] == "research"
        assert asked.headers["x-gateway"] == f"Token {SECRETS['GATEWAY_TOKEN']}"
        assert "authorization" not in asked.headers
    path = "/openai/deployments/my-deployment"
    assert [asked.path for asked in server.asked] == [
        f"{path}/{'messages' if kind == 'anthropic' else 'chat/completions'}",
        f"{path}/models",
    ]
    assert client.endpoint == server.root + path, "what is recorded has no query"
    assert not any(value in f"{caught.value} {config!r} {client.params}" for value in SECRETS.values())


def test_a_prefix_of_the_key_is_that_of_the_model_file(monkeypatch: pytest.MonkeyPatch) -> None:
    config = loads(f"{GOOD}key_header: {{name: Authorization, prefix: 'Token '}}", ModelConfig, source="m.yaml")
    assert config.key_header is not None
    assert (config.key_header.name, config.key_header.prefix) == ("Authorization", "Token ")


def test_a_process_of_an_agent_gets_every_variable_that_its_model_file_names(monkeypatch: pytest.MonkeyPatch) -> None:
    config = loads(AZURE.format(base="http://h") + "base_url_env: AZURE_URL", ModelConfig, source="m.yaml")
    given = dict.fromkeys(
        [*SECRETS, "GATEWAY_TOKEN_FILE", "AZURE_URL", "ALL_PROXY", "REQUESTS_CA_BUNDLE", "OTHER"], "x"
    )
    assert with_model(config, given).keys() == given.keys() - {"OTHER"}
    assert plain(given) == {}


BAD_AGENTS = [
    ("agents: {}", "a.yaml:1 (agents): dictionary should have at least 1 item after validation, not 0, not {}"),
    ("agents:\n  A: {}", "a.yaml:2 (agents.A): give either a model or a policy"),
    ("agents:\n  A: {model: scripted, policy: silent}", "a.yaml:2 (agents.A): give either a model or a policy"),
    (
        "agents:\n  A/B: {policy: silent}",
        (
            "a.yaml:1 (agents): agent 'A/B' cannot stand in a key: use 1 to 64 letters, digits, '_', '.' or '-', "
            "beginning with a letter or a digit"
        ),
    ),
    ("agents:\n  A: {policy: silent}\nbudget: 3", "a.yaml:3 (budget): no such field, did you mean 'budget_usd'?"),
    (
        "agents:\n  A: {policy: silent}\ndefault_reply: ''",
        "a.yaml:3 (default_reply): belongs in the task file: the host says it for all agents",
    ),
]


@pytest.mark.parametrize(("text", "expected"), BAD_AGENTS)
def test_a_wrong_agents_file_says_line_and_field(text: str, expected: str) -> None:
    with pytest.raises(ConfigError) as caught:
        loads(text, AgentsFile, source="a.yaml")
    assert str(caught.value) == expected


def test_a_model_file_is_found_beside_the_agents_file_that_names_it(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text(GOOD, encoding="utf-8")
    (tmp_path / "agents.yaml").write_text("agents:\n  A: {model: mine.yaml}\n", encoding="utf-8")
    spec = load_agents(tmp_path / "agents.yaml").agents["A"]
    policy = Workshop().policy(spec)
    assert isinstance(policy, LLMPolicy)
    assert policy.client.endpoint == "http://h/v1"


def test_agents_with_the_same_model_share_its_limits_and_not_its_connection(tmp_path: Path) -> None:
    other = tmp_path / "other.yaml"
    other.write_text(GOOD, encoding="utf-8")
    workshop = Workshop()
    a, b, c = (workshop.policy(WorkerSpec(model=name)) for name in ("scripted", "scripted", str(other)))
    assert isinstance(a, LLMPolicy)
    assert isinstance(b, LLMPolicy)
    assert isinstance(c, LLMPolicy)
    assert a.limits is b.limits
    assert a.limits is not c.limits
    assert a.limits.budget is c.limits.budget
    assert a.client is not b.client


def test_the_command_line_changes_what_a_file_says() -> None:
    policy = Workshop(overrides={"base_url": "http://other:1/v1", "model": "silent"}).policy(
        WorkerSpec(model="scripted")
    )
    assert isinstance(policy, LLMPolicy)
    assert (policy.client.endpoint, policy.client.model) == ("http://other:1/v1", "silent")


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Yield the current directory, with a module `my_agent` of the user's in it."""
    (tmp_path / "my_agent.py").write_text(
        "def decide(briefing, observation):\n    return 'text'\n\n"
        "class Mine:\n    async def decide(self, briefing, observation):\n        return 'text'\n\n"
        "from khala_agents.policy import Policy\n\n"
        "class Whole(Policy):\n    async def decide(self, context):\n        return 'text'\n\n"
        "mine = Mine()\nnumber = 3\n",
        encoding="utf-8",
    )
    (tmp_path / "broken_agent.py").write_text("raise RuntimeError('half written')\n", encoding="utf-8")
    (tmp_path / "lost_agent.py").write_text("import not_installed\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    before = list(sys.path)
    yield tmp_path
    sys.path[:] = before
    for name in ("my_agent", "broken_agent", "lost_agent"):
        sys.modules.pop(name, None)


def test_a_policy_is_found_by_its_module_in_the_current_directory(module: Path) -> None:
    trust_named("my_agent:decide")
    assert isinstance(load_policy("my_agent:decide"), FunctionPolicy)
    made, mine = load_policy("my_agent:Mine"), load_policy("my_agent:mine")
    assert isinstance(made, ObjectPolicy)
    assert isinstance(mine, ObjectPolicy)
    assert type(made.thing).__name__ == "Mine"
    assert mine.thing is sys.modules["my_agent"].mine
    assert type(load_policy("my_agent:Whole")).__name__ == "Whole"
    assert isinstance(load_policy("silent"), Silent)


BAD_POLICIES = [
    (
        "my_agent",
        (
            "'my_agent' is not a policy: write silent, random-legal, focus-fire, skilled or module:name, "
            "as my_agent:decide"
        ),
    ),
    ("nowhere:decide", "policy nowhere:decide: there is no module 'nowhere'"),
    ("lost_agent:decide", "policy lost_agent:decide: there is no module 'not_installed'"),
    ("my_agent:decide_not", "policy my_agent:decide_not: the module my_agent has no 'decide_not'"),
    ("my_agent:number", "policy my_agent:number: it is no function and has no method `decide`"),
    (
        "os:system",
        (
            "policy os:system: it takes (command): a function of a policy takes (briefing, observation), and a policy "
            "that decides with a context is a subclass of khala_agents.policy.Policy"
        ),
    ),
    ("broken_agent:decide", "policy broken_agent:decide: importing it failed: RuntimeError: half written"),
]


@pytest.mark.parametrize(("name", "text"), BAD_POLICIES)
def test_a_policy_that_cannot_be_had_is_one_clear_sentence(module: Path, name: str, text: str) -> None:
    trust_named(name)
    with pytest.raises(ConfigError) as caught:
        load_policy(name)
    assert str(caught.value) == text


BAD_SPECS = [
    ("opnai", None, {}, ("there is no model file 'opnai': did you mean openai?; write openai, "
     "openai/gpt-5, or the path of a .yaml file")),
    ("no.yaml", None, {}, "no.yaml: there is no such file"),
    ("vllm", 1.0, {}, ("a budget needs the price of Qwen/Qwen2.5-7B-Instruct at 127.0.0.1:8000, and no price is known: "
     "write `prices: {prompt: …, completion: …}` into its model file, in US dollars per million tokens; 0 for a model "
     "of your own")),
    ("scripted", None, {"base_url": "localhost"}, ("command line (base_url): 'localhost' is not a URL that begins with "
     "http:// or https://")),
]  # fmt: skip


@pytest.mark.parametrize(("model", "budget", "overrides", "text"), BAD_SPECS)
def test_a_model_that_cannot_be_had_is_one_clear_sentence(
    model: str, budget: float | None, overrides: dict[str, str], text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DEEPSEEK_API_KEY", "sk-0123456789")
    with pytest.raises(ConfigError) as caught:
        Workshop(budget=SharedBudget(budget), overrides=overrides).policy(WorkerSpec(model=model))
    assert str(caught.value) == text
