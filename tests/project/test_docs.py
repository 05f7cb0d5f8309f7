"""The documentation, executed: its Python runs, its commands parse, its files are valid, its links lead somewhere.

The first word after a fence is the language, the second says what a block is: `python compile` is not run, since it
needs a network; `yaml task`, `yaml model`, `yaml agents` and `yaml actions` are files that are read as such, `yaml
scenario` is played.
"""

from __future__ import annotations

import importlib.util
import inspect
import itertools
import json
import os
import re
import shlex
import shutil
import tomllib
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest
import typer

from docs import generate
from docs.generate import PAGES, REFERENCE, main, outdated, write
from docs.pages.markdown import anchor, cell, table
from docs.pages.schema import attributes
from khala_agents.config import AgentsFile, ModelConfig
from khala_agents.policy import Context, Policy, as_policy
from khala_bridge.catalogue import catalogue
from khala_bridge.errors import CatalogueError
from khala_bridge.task.config import TaskConfig
from khala_protocol import speech
from khala_protocol.codec import decode
from khala_protocol.configfile import loads
from khala_protocol.errors import ConfigError
from khala_protocol.messages import Briefing
from khala_protocol.recording import Recording
from khala_sc2 import testing
from khala_sc2.cli import app
from khala_simulator.maps.map_file import read_map
from khala_simulator.tick import advance, new_game

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from _pytest.mark import ParameterSet
    from pydantic import BaseModel

    from khala_protocol.messages import Observation

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md")))
GOLDEN = ROOT / "tests" / "khala" / "golden.mcap"
FENCE = re.compile(r"^```(?P<info>[^\n`]*)\n(?P<text>.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\[[^\]]*\]\((?P<target>[^)\s]+)\)")
MODELS: dict[str, type[BaseModel]] = {"yaml task": TaskConfig, "yaml model": ModelConfig, "yaml agents": AgentsFile}
LANGUAGES = {
    "python",
    "python compile",
    "bash",
    "console",
    "text",
    "json",
    "json client",
    "toml client",
    "yaml scenario",
    "yaml actions",
    *MODELS,
}
OTHER_PROGRAMS = {
    "cd", "claude", "cp", "curl", "docker", "export", "git", "inspect", "kubectl", "make", "mkdir", "pip", "ray",
    "sbatch", "scp", "source", "ssh",
}  # fmt: skip
ALONE = {"khala-agent": "agent", "khala-llm": "llm", "khala-sc2": "sc2"}
"""The commands of a package that is installed without the others, and what `khala` calls them."""


class Block(NamedTuple):
    """A block of code on a page."""

    page: Path
    line: int
    info: str
    text: str

    @property
    def name(self) -> str:
        return f"{self.page.relative_to(ROOT).as_posix()}:{self.line}"


def all_blocks() -> Iterator[Block]:
    for page in DOCUMENTS:
        text = page.read_text(encoding="utf-8")
        for found in FENCE.finditer(text):
            yield Block(page, text[: found.start()].count("\n") + 1, found["info"].strip(), found["text"])


BLOCKS = tuple(all_blocks())


def blocks(*infos: str) -> list[ParameterSet]:
    return [pytest.param(block, id=block.name) for block in BLOCKS if block.info in infos]


# --- Python -------------------------------------------------------------------------------------------


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run in a directory with the files that the pages name."""
    (tmp_path / "tests").mkdir()
    for name in ("recording.mcap", "golden.mcap", "tests/golden.mcap"):
        shutil.copy(GOLDEN, tmp_path / name)
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="module")
def scene() -> tuple[Briefing, Observation]:
    """Return an agent's briefing, and its observation in the middle of a battle."""
    golden = Recording.open(GOLDEN)
    observations = itertools.islice(golden.observations("Zealots"), 10, None)
    return next(golden.of(Briefing, agent="Zealots")), next(seen for seen in observations if seen.view.teams[0].enemies)


@pytest.mark.parametrize("block", blocks("python"))
@pytest.mark.usefixtures("place", "own_sections")
async def test_a_block_of_python_runs(block: Block, scene: tuple[Briefing, Observation]) -> None:
    namespace = run(block)
    for name, thing in namespace.items():
        if name == "decide":
            await check_policy(as_policy(thing), scene)
        elif isinstance(thing, type) and thing.__module__ == block.name and hasattr(thing, "decide"):
            await check_policy(as_policy(thing()), scene)
        elif name.startswith("test_"):
            await thing(**{fixture: double(fixture) for fixture in inspect.signature(thing).parameters})


@pytest.mark.parametrize("block", blocks("python compile"))
def test_a_block_of_python_that_needs_a_network_compiles(block: Block) -> None:
    compile(block.text, block.name, "exec")


def run(block: Block) -> dict[str, Any]:
    namespace: dict[str, Any] = {"__name__": block.name}
    exec(compile("\n" * block.line + block.text, block.page, "exec"), namespace)
    return dict(namespace)


async def check_policy(policy: Policy, scene: tuple[Briefing, Observation]) -> None:
    """Decide once; the reply must be understood, with allowed actions only."""
    briefing, observation = scene
    await policy.prepare(briefing)
    text = await policy.decide(Context(briefing, observation))
    assert isinstance(text, str)
    said = speech.parse(text)
    assert not said.faults
    assert {call.name for call in said.calls} <= {action.name for action in briefing.actions}
    await policy.close()


def double(fixture: str) -> Callable[..., Any]:
    """Return a fixture of `khala_sc2.pytest_plugin` that finds no difference, if it is called as the real one may be."""
    real = inspect.signature(getattr(testing, fixture))

    async def find_none(*args: Any, **kwargs: Any) -> list[object]:
        assert os.path.isfile(real.bind(*args, **kwargs).arguments["path"])  # noqa: ASYNC240, PTH113  # nothing waits here
        return []

    return find_none


# --- commands -----------------------------------------------------------------------------------------


def commands() -> list[tuple[str, str]]:
    """Return every line that a reader may type, and its place; of a console session, the text after the prompt."""
    found = []
    for block in BLOCKS:
        prompt = {"bash": "", "console": "$ "}.get(block.info)
        if prompt is None:
            continue
        for number, line in enumerate(block.text.splitlines(), start=block.line + 1):
            if line.startswith(prompt) and line.strip() and not line.startswith("#"):
                place = f"{block.page.relative_to(ROOT).as_posix()}:{number}"
                found.append((place, line.removeprefix(prompt)))
    return found


@cache
def every_command() -> Any:
    """Return what `khala` is, built once, since that takes 20 ms."""
    return typer.main.get_command(app)


def find(words: list[str]) -> tuple[Any, list[str]]:
    """Return the command that the first words name, and the words after them."""
    command = every_command()
    while hasattr(command, "commands") and words and not words[0].startswith("-"):
        name, *words = words
        command = command.commands[name]
    return command, words


def parse(words: list[str]) -> None:
    """Parse words as the command line does, without running them. Raise what it raises."""
    command, words = find(words)
    command.make_context("khala", words)


def test_a_command_can_be_given(subtests: pytest.Subtests, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in os.environ if name.startswith("KHALA_")]:
        monkeypatch.delenv(name)
    for place, line in commands():
        with subtests.test(place):
            for part in re.sub(r"\$\([^)]*\)", "", line).split(" && "):
                program, *words = itertools.dropwhile(lambda word: "=" in word, shlex.split(part, comments=True))
                if program == "khala" or program in ALONE:
                    parse([ALONE[program], *words] if program in ALONE else words)
                elif program == "make":
                    assert re.search(rf"^{words[0]}:", (ROOT / "Makefile").read_text(), re.MULTILINE), (
                        f"make {words[0]}"
                    )
                elif program == "python" and words[0] == "-m":
                    assert importlib.util.find_spec(words[1]), f"python -m {words[1]}"
                elif program == "python":
                    assert (ROOT / words[0]).is_file(), f"python {words[0]}"
                else:
                    assert program in OTHER_PROGRAMS


def test_commands_in_sentences_exist_with_their_options(subtests: pytest.Subtests) -> None:
    for page in DOCUMENTS:
        with subtests.test(page.relative_to(ROOT).as_posix()):
            for said in re.findall(r"`khala ([^`]+)`", prose(page)):
                command, words = find(said.split())
                options = {option for parameter in command.params for option in parameter.opts} | {"--help"}
                assert {word for word in words if word.startswith("-")} <= options, said


@pytest.mark.parametrize(("words", "fault"), [("run 2s3z --sead 1", "--sead"), ("rum 2s3z", "rum")])
def test_a_wrong_command_would_be_found(words: str, fault: str) -> None:
    with pytest.raises(Exception, match=fault) as raised:
        parse(words.split())
    assert not isinstance(raised.value, AssertionError)


# --- files and messages -------------------------------------------------------------------------------


@pytest.mark.parametrize("block", blocks(*MODELS))
def test_a_file_on_a_page_is_valid(block: Block) -> None:
    loads(block.text, MODELS[block.info], source=block.name)


@pytest.mark.parametrize("block", blocks("yaml actions"))
def test_actions_on_a_page_could_stand_in_the_catalogue(block: Block, tmp_path: Path) -> None:
    (tmp_path / "page.yaml").write_text(block.text, encoding="utf-8")
    found = catalogue.read(tmp_path / "page.yaml")
    assert found
    assert {action.group for action in found.values()} <= set(catalogue.GROUPS)
    assert not {name.casefold() for name in found} & {name.casefold() for name in catalogue.catalogue()}


def test_the_fault_of_an_action_is_told_as_the_page_says(tmp_path: Path) -> None:
    page = ROOT / "docs" / "how-to" / "add-an-action.md"
    (block,) = (block for block in BLOCKS if block.page == page and block.info == "yaml actions")
    file = tmp_path / "zerg_raid.yaml"
    file.write_text(block.text.replace("Move_minimap", "Move_minmap"), encoding="utf-8")
    with pytest.raises(CatalogueError) as raised:
        catalogue.read(file)
    assert f"khala: {raised.value}\n" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize("block", blocks("yaml scenario"))
def test_a_scenario_on_a_page_is_played_to_its_end(block: Block) -> None:
    world = new_game(read_map(block.text.encode(), block.name), seed=1)
    advance(world, 5000)
    assert world.ended


def test_the_mistake_in_the_tutorial_is_reported_as_it_says() -> None:
    page = ROOT / "docs" / "tutorial" / "first-battle.md"
    (task,) = (block for block in BLOCKS if block.page == page and block.info == "yaml task")
    with pytest.raises(ConfigError) as raised:
        loads(task.text.replace("[Stalker]", "[Stlaker]", 1), TaskConfig, source="kite.yaml")
    assert f"khala: {raised.value}\n" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize("block", blocks("json"))
def test_a_message_on_a_page_is_one_of_the_protocol(block: Block) -> None:
    assert decode(block.text.encode()).run


@pytest.mark.parametrize("block", blocks("json client", "toml client"))
def test_a_file_of_an_mcp_client_starts_a_command_that_can_be_given(block: Block) -> None:
    read = tomllib.loads if block.info.startswith("toml") else json.loads
    (servers,) = read(block.text).values()
    for server in servers.values():
        if "url" not in server:
            assert Path(server["command"]).name == "khala"
            parse(server["args"])


def test_every_block_says_what_it_is() -> None:
    assert {block.info for block in BLOCKS} <= LANGUAGES
    assert {block.info for block in BLOCKS} >= {"python", "bash", "console", "json", "yaml task", "yaml model"}


# --- links --------------------------------------------------------------------------------------------


def prose(page: Path) -> str:
    return FENCE.sub("", page.read_text(encoding="utf-8"))


def anchors(page: Path) -> set[str]:
    return {anchor(title) for title in re.findall(r"^#+ (.+)$", prose(page), re.MULTILINE)}


def test_links_lead_somewhere(subtests: pytest.Subtests) -> None:
    for page in (*DOCUMENTS, ROOT / "docs" / "llms.txt"):
        with subtests.test(page.relative_to(ROOT).as_posix()):
            targets = {found["target"] for found in LINK.finditer(prose(page))}
            broken = []
            for target in targets:
                path, _, title = target.partition("#")
                file = (page.parent / path).resolve() if path else page
                if "://" in target:
                    continue
                if not file.exists() or not file.is_relative_to(ROOT) or (title and f"#{title}" not in anchors(file)):
                    broken.append(target)
            assert not broken


def test_a_column_without_a_word_about_it_cannot_be_documented() -> None:
    assert [name for name, _ in attributes(Described)] == ["wordy"]
    with pytest.raises(LookupError, match="Silent says nothing of mute: write a docstring under each"):
        attributes(Silent)


class Described:
    """A class whose field has a docstring."""

    wordy: int
    """About it."""


class Silent:
    """A class with a field that has none."""

    mute: int


def test_every_page_can_be_found_from_the_map_of_the_documentation() -> None:
    start = ROOT / "docs" / "README.md"
    named = {(start.parent / found["target"]).resolve() for found in LINK.finditer(prose(start))}
    assert set(DOCUMENTS) - named == {ROOT / "README.md", start}


# --- generated pages ----------------------------------------------------------------------------------


def test_the_reference_is_up_to_date() -> None:
    assert outdated() == [], "`make docs` writes these pages again"


@pytest.fixture
def quick_pages(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every page be what its file says, since making them all takes seconds."""
    made = {path.name: partial(path.read_text, encoding="utf-8") for path in REFERENCE.glob("*.md")}
    assert made.keys() == PAGES.keys()
    monkeypatch.setattr("docs.generate.PAGES", made)


@pytest.mark.usefixtures("quick_pages")
def test_a_page_that_is_old_missing_or_foreign_is_found(tmp_path: Path) -> None:
    write(tmp_path)
    assert outdated(tmp_path) == []
    (tmp_path / "cli.md").write_text("old")
    (tmp_path / "maps.md").unlink()
    (tmp_path / "foreign.md").write_text("by hand")
    assert outdated(tmp_path) == ["cli.md", "foreign.md", "maps.md"]


@pytest.mark.usefixtures("quick_pages")
def test_check_fails_and_says_what_to_do(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--check"]) == 0
    monkeypatch.setitem(generate.PAGES, "cli.md", lambda: "new")
    before = (REFERENCE / "cli.md").read_bytes()
    assert main(["--check"]) == 1
    assert "cli.md; `make docs`" in capsys.readouterr().err
    assert (REFERENCE / "cli.md").read_bytes() == before


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, ""),
        (2.50, "2.5"),
        ("two\nlines", "two lines"),
        ("a | b", "a \\| b"),
        ("<Stop()> and `<Stop()>`", "&lt;Stop()> and `<Stop()>`"),
        ("``World`` in a docstring", "`World` in a docstring"),
    ],
)
def test_a_value_stands_in_a_table(value: object, text: str) -> None:
    assert cell(value) == text


def test_a_column_that_is_empty_everywhere_is_left_out() -> None:
    assert table(("a", "b", "c"), [(1, "", 2), (3, None, 4)]) == "| a | c |\n| --- | --- |\n| 1 | 2 |\n| 3 | 4 |"
