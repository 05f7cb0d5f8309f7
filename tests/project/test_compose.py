"""The image, the compose files and what the documentation says of them."""

from __future__ import annotations

import contextlib
import itertools
import re
import shlex
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import typer.main
import yaml
from check_jsonschema import main as check_jsonschema  # type: ignore[import-untyped]  # it is no library
from click.testing import CliRunner

from khala_agents.config import load_model, model_files
from khala_orchestrator.config import load_task
from khala_sc2.cli import app

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

ROOT = Path(__file__).resolve().parents[2]
FILES = ("docker-compose.yml", "docker-compose.lan.yml")
PAGES = ("docs/how-to/many-machines.md", "docs/how-to/containers.md")
VARIABLE = re.compile(r"\$\{(?P<name>\w+)(?::-(?P<default>[^}]*))?\}")

COMPOSE: dict[str, Any] = yaml.safe_load((ROOT / FILES[0]).read_text())
LAN: dict[str, Any] = yaml.safe_load((ROOT / FILES[1]).read_text())
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]
KEYS = {key for name in model_files() if (key := load_model(name).api_key_env)}
IMAGES = {"llm": "khala-agents", "agents": "khala-agents", "experiment": "khala-ray", "worker": "khala-ray"}
CLUSTER = {"experiment", "worker", "page"}
"""Services of the profile `experiment`, which need none of the others."""
every_service = pytest.mark.parametrize("service", SERVICES)


# --- valid by the specification ----------------------------------------------------------------------


def complaints(*files: Path) -> str:
    """Return the complaints of the compose specification's schema about files; empty if nothing is wrong."""
    with contextlib.chdir(ROOT):
        arguments = ["--builtin-schema", "vendor.compose-spec", *map(str, files)]
        done = CliRunner().invoke(check_jsonschema, arguments, catch_exceptions=False)
    assert not done.stderr
    return done.stdout if done.exit_code else ""


def test_compose_files_are_what_the_specification_wants() -> None:
    assert complaints(*map(Path, FILES)) == ""


@pytest.mark.parametrize(
    ("right", "wrong", "complaint"),
    [
        ("command: router", "comand: router", "services.router: Unevaluated properties are not allowed ('comand'"),
        ("cap_drop: [ALL]", "cap_drop: ALL", "cap_drop: 'ALL' is not of type 'array'"),
        ("condition: service_started", "condition: soon", "agents.condition: 'soon' is not one of"),
    ],
)
def test_a_mistake_in_a_compose_file_would_be_found(tmp_path: Path, right: str, wrong: str, complaint: str) -> None:
    file = tmp_path / FILES[0]
    text = (ROOT / FILES[0]).read_text()
    assert right in text
    file.write_text(text.replace(right, wrong))
    assert complaint in complaints(file)


@pytest.mark.parametrize("name", FILES)
def test_every_variable_has_a_default(name: str) -> None:
    for found in VARIABLE.finditer((ROOT / name).read_text()):
        assert found["default"], f"{found['name']} would have to be set"


def test_the_second_file_changes_what_the_first_one_has() -> None:
    assert LAN["services"].keys() <= SERVICES.keys()
    for service in LAN["services"].values():
        assert set(service["networks"]) <= set(COMPOSE["networks"])


# --- what a container may do --------------------------------------------------------------------------


@every_service
@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("read_only", True),
        ("init", True),
        ("tmpfs", ["/tmp"]),
        ("cap_drop", ["ALL"]),
        ("security_opt", ["no-new-privileges:true"]),
    ],
)
def test_a_service_is_locked_down(service: str, field: str, value: object) -> None:
    assert plain(SERVICES[service][field]) == value


@every_service
def test_a_service_runs_in_the_image_that_has_what_it_needs(service: str) -> None:
    image = IMAGES.get(service, "khala")
    assert plain(SERVICES[service]["image"]) == image
    target = "agents" if image == "khala-agents" else "khala"
    extras = {"args": {"EXTRAS": "--extra ray"}} if image == "khala-ray" else {}
    assert SERVICES[service]["build"] == {"context": ".", "target": target} | extras


@every_service
@pytest.mark.parametrize("field", ["privileged", "cap_add", "devices", "pid", "ipc", "network_mode", "ports"])
def test_a_service_asks_for_nothing_that_opens_it(service: str, field: str) -> None:
    if (service, field) == ("page", "ports"):
        assert plain(SERVICES[service][field]) == ["127.0.0.1:8000:8000"], "of this machine alone"
        assert parsed(command_of(service))["published"] == "127.0.0.1:8000"
    else:
        assert field not in SERVICES[service]


@every_service
def test_a_service_runs_as_an_ordinary_user(service: str) -> None:
    user, group = map(int, plain(SERVICES[service]["user"]).split(":"))
    assert user > 0 and group > 0


@every_service
def test_a_service_is_healthy_or_waits_for_one_that_is(service: str) -> None:
    conditions = {name: needed["condition"] for name, needed in SERVICES[service].get("depends_on", {}).items()}
    assert service in CLUSTER or "healthcheck" in SERVICES[service] or "service_healthy" in conditions.values()
    for name, condition in conditions.items():
        assert condition == ("service_healthy" if "healthcheck" in SERVICES[name] else "service_started")


def test_only_agents_workers_and_the_page_reach_the_world() -> None:
    inside = {name for name, network in COMPOSE["networks"].items() if network.get("internal")}
    outside = {name for name, service in SERVICES.items() if not inside.issuperset(service["networks"])}
    assert outside == {"agents", "worker", "page"}
    on_bus = {name for name, service in SERVICES.items() if "bus" in service["networks"]}
    assert not on_bus & CLUSTER


def test_an_experiment_is_played_when_its_profile_is_asked_for() -> None:
    assert {name for name, service in SERVICES.items() if service.get("profiles") == ["experiment"]} == CLUSTER
    asked = parsed(command_of("experiment"))
    assert asked["out"].is_relative_to("/runs"), "where the volume is"
    assert SERVICES["experiment"]["depends_on"].keys() == {"worker", "page"}
    assert parsed(command_of("worker"))["address"] == asked["head"] == "experiment:6379"
    assert set(SERVICES["worker"]["networks"]) >= set(SERVICES["experiment"]["networks"]) == {"cluster"}


def test_who_joins_from_outside_comes_over_loopback_unless_told_otherwise() -> None:
    assert plain(LAN["services"]["router"]["ports"]) == ["127.0.0.1:7447:7447"]


def test_services_stay_and_a_match_ends() -> None:
    policies = {name: service["restart"] for name, service in SERVICES.items()}
    ending = {"host": "no", "experiment": "no", "worker": "on-failure"}
    assert policies == dict.fromkeys(SERVICES, "unless-stopped") | ending


# --- keys ---------------------------------------------------------------------------------------------


def test_keys_are_given_to_agents_as_a_file_and_to_nobody_else() -> None:
    assert [name for name, service in SERVICES.items() if "secrets" in service] == ["agents", "experiment", "worker"]
    for service in ("agents", "experiment", "worker"):
        environment = SERVICES[service]["environment"]
        assert {name for name in environment if "KEY" in name} == {f"{key}_FILE" for key in KEYS}
        assert {environment[f"{key}_FILE"] for key in KEYS} == {"/run/secrets/model_key"}
    assert set(COMPOSE["secrets"]["model_key"]) == {"file"}


@pytest.mark.parametrize("name", ["Dockerfile", *FILES, *PAGES])
def test_no_key_is_set_anywhere(name: str) -> None:
    assert not re.search(r"(API_KEY|TOKEN|SECRET|PASSWORD)\s*[:=]|sk-\w", (ROOT / name).read_text())


# --- command lines ------------------------------------------------------------------------------------


def plain(value: Any) -> Any:
    """Return a value of a compose file where no variable is set."""
    if isinstance(value, list):
        return [plain(part) for part in value]
    return VARIABLE.sub(lambda found: found["default"], value) if isinstance(value, str) else value


def command_of(service: str) -> list[str]:
    """Return the words after `khala` of a service; `khala-agent` is `khala agent` with only the agents installed."""
    entrypoint = SERVICES[service].get("entrypoint", "khala").removeprefix("khala").removeprefix("-")
    return shlex.split(f"{entrypoint} {plain(SERVICES[service]['command'])}")


def parsed(words: list[str]) -> Mapping[str, Any]:
    """Return the command line's reading of `khala <words>`, without running it."""
    command: Any = typer.main.get_command(app)
    name = ""
    while hasattr(command, "commands"):
        name, *words = words
        assert name in command.commands, f"there is no command {name!r}"
        command = command.commands[name]
    with command.make_context(name, words) as context:
        return dict(context.params)


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["host", "2s3z", "--sead", "1"], "No such option: --sead"),
        (["agent", "Stalkers"], "Missing parameter: run"),
        (["host", "2s3z", "--episodes", "none"], "should be a valid integer"),
        (["hosts"], "there is no command 'hosts'"),
    ],
)
@pytest.mark.usefixtures("environment")
def test_a_command_that_cannot_be_given_would_be_found(words: list[str], complaint: str) -> None:
    with pytest.raises(Exception, match=complaint):
        parsed(words)


def blocks(page: str) -> Iterator[str]:
    """Yield the blocks of shell commands on a page."""
    yield from re.findall(r"^```bash\n(.*?)^```$", (ROOT / page).read_text(), re.MULTILINE | re.DOTALL)


def lines(page: str) -> list[list[str]]:
    """Return the commands on a page, in blocks and in sentences, as words, without variables in front."""
    commands = [line for block in blocks(page) for line in block.splitlines()]
    commands += re.findall(r"`((?:khala|docker) [^`…]*)`", (ROOT / page).read_text())
    return [shlex.split(re.sub(r"^(\w+=\S+ )+", "", re.sub(r"\$\(.*?\)", "", line))) for line in commands]


def khala_words(words: list[str]) -> list[str] | None:
    """Return the words after `khala`, also where it runs in a container; None if it does not run here."""
    match words:
        case ["khala", *rest]:
            return rest
        case ["docker", "run", *options] if "khala" in options:
            return options[options.index("khala") + 1 :]
        case ["docker", "compose", "run", *options]:
            service, *rest = itertools.dropwhile(lambda word: word.startswith("--"), options)
            assert service in SERVICES
            return rest or command_of(service)
    assert "run" not in words
    return None


@pytest.fixture
def environment(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Set the environment of a service."""

    def be(service: str) -> None:
        for name, value in SERVICES[service].get("environment", {}).items():
            monkeypatch.setenv(name, plain(value))

    for name in ("KHALA_RUN", "KHALA_AGENTS"):
        monkeypatch.delenv(name, raising=False)
    return be


@every_service
def test_a_service_is_a_command_of_khala(service: str, environment: Callable[[str], None]) -> None:
    environment(service)
    words = command_of(service)
    assert parsed(words)
    test = SERVICES[service].get("healthcheck", {}).get("test", [])
    if test[1:2] == ["khala"]:
        assert parsed(test[2:])["check"]


def test_host_and_agents_of_the_compose_file_belong_together(environment: Callable[[str], None]) -> None:
    environment("agents")
    environment("host")
    agents = parsed(command_of("agents"))
    host = parsed(command_of("host"))
    task = load_task(host["task"])
    assert list(agents["names"]) == [agent.name for agent in task.agents]
    assert (agents["run"], agents["side"], agents["connect"]) == (host["run"], task.side, host["connect"])
    assert plain(SERVICES["host"]["volumes"]) == [f"runs:{host['out']}"]


@pytest.mark.parametrize("line", sorted({shlex.join(words) for page in PAGES for words in lines(page)}))
def test_a_command_of_the_documentation_can_be_given(line: str, environment: Callable[[str], None]) -> None:
    words = khala_words(shlex.split(line))
    if words is None:
        assert line.partition(" ")[0] in {"docker", "scp", "ssh", "mkdir", "export"}
        return
    if line.startswith("docker compose"):
        environment("agents")
    assert parsed(words)


def test_the_documentation_of_containers_names_every_variable_with_its_default() -> None:
    text = "\n".join((ROOT / name).read_text() for name in FILES)
    in_files = {found["name"]: found["default"] for found in VARIABLE.finditer(text)}
    table = re.findall(r"^\| `(\w+)` \| `(.*?)` \|", (ROOT / PAGES[1]).read_text(), re.MULTILINE)
    assert dict(table) == in_files
    assert len(table) == len(in_files)


@pytest.mark.parametrize("page", PAGES)
def test_the_documentation_names_files_and_services_that_exist(page: str) -> None:
    for words in lines(page):
        if words[:2] != ["docker", "compose"]:
            continue
        files = [after for before, after in itertools.pairwise(words) if before == "-f"]
        assert set(files) <= set(FILES)
        profiles = [after for before, after in itertools.pairwise(words) if before == "--profile"]
        assert set(profiles) <= {"experiment"}
        if "up" in words:
            named = words[words.index("up") + 1 :]
            assert {word for word in named if word[0] != "-" and "=" not in word} <= SERVICES.keys()


# --- the image ----------------------------------------------------------------------------------------


def instructions(name: str) -> list[str]:
    """Return the values of an instruction in the Dockerfile, in order."""
    text = re.sub(r"\\\n\s*", "", (ROOT / "Dockerfile").read_text())
    return re.findall(rf"^{name} (.*)$", text, re.MULTILINE)


def test_the_images_run_as_an_ordinary_user() -> None:
    assert instructions("ENTRYPOINT") == ['["khala-agent"]', '["khala"]']
    assert instructions("USER") == ["1000:1000", "1000:1000"]
    assert plain(SERVICES["host"]["user"]) == "1000:1000"


def test_the_images_hold_what_the_lock_file_says_and_no_more() -> None:
    syncs = [run for run in instructions("RUN") if "uv sync" in run]
    assert len(syncs) == 2
    assert all("--frozen --no-dev --no-editable" in run for run in syncs)
    assert "--package khala-sc2-agents" in syncs[0]
    assert instructions("FROM")[-2:] == ["base AS agents", "base AS khala"]  # the last one is built by default


def test_the_simulator_is_where_the_host_looks_for_it(environment: Callable[[str], None]) -> None:
    (made,) = re.findall(r"khala sc2 install (\S+)", (ROOT / "Dockerfile").read_text())
    assert parsed(command_of("host"))["game"] == made
    assert f"SC2PATH={made}" in instructions("ENV")[-1]


def test_the_build_sees_the_packages_and_nothing_else() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    packages = ["khala_sc2", *project["tool"]["uv"]["workspace"]["members"]]
    rules = [line for line in (ROOT / ".dockerignore").read_text().splitlines() if not line.startswith("#")]
    assert rules[0] == "*"
    needed = {f"{package}/" for package in packages} | {"LICENSE", "README.md", "pyproject.toml", "uv.lock"}
    assert {rule.removeprefix("!") for rule in rules if rule.startswith("!")} == needed
