"""A model's address from the environment: for containers, where the endpoint has its own name."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_agents.build import Workshop
from khala_agents.config import ModelConfig, WorkerSpec
from khala_agents.llm_policy import LLMPolicy
from khala_protocol.configfile import loads
from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from pathlib import Path

IN_FILE, IN_ENVIRONMENT, GIVEN = "http://127.0.0.1:1/v1", "http://llm:2/v1", "http://other:3/v1"
FILE = f"profile: compatible\nmodel: m\nbase_url: {IN_FILE}\n"


@pytest.fixture
def model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return the path of a model file that names a variable, which is not set."""
    monkeypatch.delenv("MINE_BASE_URL", raising=False)
    path = tmp_path / "mine.yaml"
    path.write_text(FILE + "base_url_env: MINE_BASE_URL\n", encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(
    ("variable", "option", "used"),
    [
        (None, None, IN_FILE),
        ("", None, IN_FILE),
        (IN_ENVIRONMENT, None, IN_ENVIRONMENT),
        (IN_ENVIRONMENT, GIVEN, GIVEN),
        (None, GIVEN, GIVEN),
    ],
)
def test_an_option_goes_before_the_environment_and_that_before_the_file(
    model: str, variable: str | None, option: str | None, used: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if variable is not None:
        monkeypatch.setenv("MINE_BASE_URL", variable)
    policy = Workshop(overrides={"base_url": option}).policy(WorkerSpec(model=model))
    assert isinstance(policy, LLMPolicy)
    assert policy.client.endpoint == used


def test_a_wrong_address_names_the_variable_that_holds_it(model: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MINE_BASE_URL", "llm:2")
    with pytest.raises(ConfigError) as caught:
        Workshop().policy(WorkerSpec(model=model))
    assert str(caught.value) == "MINE_BASE_URL (base_url): 'llm:2' is not a URL that begins with http:// or https://"


def test_what_is_no_name_of_a_variable_is_refused() -> None:
    with pytest.raises(ConfigError) as caught:
        loads(FILE + "base_url_env: http://llm:2/v1\n", ModelConfig, source="m.yaml")
    assert str(caught.value) == (
        "m.yaml:4 (base_url_env): write the name of an environment variable here, such as VLLM_BASE_URL"
    )
