"""What docstrings, comments and pages name exists: modules with their attributes, and files.

A name with dots counts if it begins with a package of this project; a path counts if it begins with a folder of the
repository, ends in `.py` or, between backticks, in another suffix of ours. `*` and `<version>` stand for anything.
A path may start at the root, at the place that mentions it or at the package around that; a page may mean any package.
"""

from __future__ import annotations

import ast
import functools
import importlib
import re
from fnmatch import fnmatch
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import pytest

from khala_orchestrator.config import all_tasks

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = (
    "agents",
    "bench",
    "bridge",
    "configs",
    "docs",
    "khala_sc2",
    "orchestrator",
    "protocol",
    "simulator",
    "tests",
)
PACKAGES = ("khala_sc2", *(f"khala_{folder}" for folder in FOLDERS if (ROOT / folder / f"khala_{folder}").is_dir()))
HIDDEN = {"__pycache__", "build", "dist"}

NAME = re.compile(rf"(?<![\w./-])(?:{'|'.join(PACKAGES)})(?:\.[A-Za-z_]\w*)+(?![\w/-])")
PATH = re.compile(rf"(?<![\w./<>-])(?:{'|'.join(FOLDERS)})/[\w.*<>/-]*[\w*>]")
PLACED = re.compile(r"`([A-Za-z_][\w.]*)` in `(khala[\w.]*)`")
FILE = re.compile(r"`([\w*<>-][\w.*<>/-]*\.(?:py|md|yaml|toml|json|tsv))`")
MODULE = re.compile(r"(?<![\w./<>*-])\w[\w/]*\.py\b")

# What looks like ours and is not: keys of the bus, files that a reader or a command writes, files of the game.
KEY = re.compile(r"khala/(?:<run>|first|first2|duel)(?:/|$)|khala_sc2/service/(?:order/|matches$)")
FOREIGN = {
    "kite.yaml": "a reader of the tutorial writes it",
    "my_model.yaml": "a reader writes it",
    "my_sections.py": "a reader writes it",
    "my_agent.py": "a reader writes it",
    "my_rewards.py": "a reader writes it",
    "my_program.py": "a reader has it",
    "serve_gguf.py": "a reader writes it",
    "arenas/mine/results.json": "`khala arena run` writes it",
    "results.json": "`khala arena run` writes it",
    "first.json": "a maintainer keeps it, of `khala arena run first`",
    "levels.json": "a maintainer keeps it, of `khala arena run levels`",
    "tokenizer.json": "the file of a tokenizer",
    "docs/gallery": "`python -m docs.gallery` writes it",
    "docs/gallery/NAME.html": "`python -m docs.gallery` writes it",
    "run.py": "a reader writes it, or has it of a bot",
    "my_bot/run.py": "a reader has it",
    "tests/golden.mcap": "a reader records it",
    "<out>/scenarios.md": "`make scenarios` writes it",
    "stableid.json": "StarCraft II writes it",
    "bench/results/DATE-COMMIT.json": "`make bench` writes it",
    "DATE-COMMIT.json": "`make bench` writes it",
    "docs/images/measurements": "`python -m bench history` writes it, once results are kept",
}


class Mention(NamedTuple):
    """A text that people read, and where it is."""

    file: Path
    line: int
    text: str


def mentions() -> Iterator[Mention]:
    """Every docstring, comment and page of the repository."""
    for file in files():
        if file.suffix == ".md":
            yield from (Mention(file, n, line) for n, line in enumerate(file.read_text("utf-8").splitlines(), start=1))
        elif file.suffix == ".py":
            yield from in_code(file, file.read_text("utf-8"))


@functools.cache
def files() -> tuple[Path, ...]:
    """Every file of the repository that is written by people or read by them."""
    found = (*ROOT.glob("*.md"), *(file for folder in FOLDERS for file in (ROOT / folder).rglob("*.*")))
    return tuple(file for file in found if not HIDDEN & set(file.relative_to(ROOT).parts))


def in_code(file: Path, source: str) -> Iterator[Mention]:
    """The docstrings and comments of a module."""
    yield from documented(file, ast.parse(source))
    for number, line in enumerate(source.splitlines(), start=1):
        if "#" in line:
            yield Mention(file, number, line.partition("#")[2])


def documented(file: Path, node: ast.AST) -> Iterator[Mention]:
    """The docstrings of a node and of what is defined within its statements; expressions are not looked at."""
    if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
        yield Mention(file, node.body[0].lineno if node.body else 1, ast.get_docstring(node) or "")
    for part in ("body", "orelse", "handlers", "finalbody"):
        inside = getattr(node, part, ())
        for statement in inside if isinstance(inside, list) else ():
            yield from documented(file, statement)


@functools.cache
def resolves(name: str) -> bool:
    """True if a name with dots is a module of this project, or an attribute of one."""
    parts = name.split(".")
    for end in range(len(parts), 0, -1):
        try:
            found: object = importlib.import_module(".".join(parts[:end]))
        except ModuleNotFoundError:
            continue
        return has(found, parts[end:])
    return False


def has(thing: object, attributes: list[str]) -> bool:
    """True if a chain of attributes leads somewhere; a field of a class counts, with a value or without."""
    for attribute in attributes:
        if not hasattr(thing, attribute):
            return attribute in getattr(thing, "__annotations__", {}) or attribute in getattr(thing, "model_fields", {})
        thing = getattr(thing, attribute)
    return True


@functools.cache
def exists(path: str, mentioned_in: Path) -> bool:
    """True if a path leads to a file, from the root, from where it is mentioned or from the package around that."""
    if path in FOREIGN or KEY.match(path) or path in evaluated():
        return True
    pattern = re.sub(r"<[^>]*>", "*", path).rstrip("/")
    places = (ROOT, mentioned_in.parent, *around(mentioned_in))
    if any(leads(place, pattern) for place in places):
        return True
    return "/" not in pattern and any(fnmatch(name, pattern) for place in around(mentioned_in) for name in below(place))


@functools.cache
def evaluated() -> frozenset[str]:
    """What inspect_ai calls our tasks and their solver."""
    return frozenset(f"khala_sc2/{name}" for name in ("team", *(config.name for config in all_tasks())))


@functools.cache
def below(place: Path) -> frozenset[str]:
    """The names of the files in a folder and in those below it."""
    return frozenset(file.name for file in files() if file.is_relative_to(place))


@functools.cache
def leads(place: Path, pattern: str) -> bool:
    """True if a path with or without `*` leads somewhere."""
    return next(place.glob(pattern), None) is not None if "*" in pattern else (place / pattern).exists()


def around(file: Path) -> list[Path]:
    """The package that a file belongs to, or its folder; every package for a page."""
    folder = file.relative_to(ROOT).parts[0]
    if folder == "docs" or file.parent == ROOT:
        return [ROOT, *(ROOT / folder / f"khala_{folder}" for folder in FOLDERS)]
    package = ROOT / folder / f"khala_{folder}"
    return [package] if package.is_dir() else [ROOT / folder]


def stale(mention: Mention) -> list[str]:
    """What a text names that does not exist."""
    paths = {*PATH.findall(mention.text), *FILE.findall(mention.text), *MODULE.findall(mention.text)}
    names = {name for name in NAME.findall(mention.text) if not name.endswith(".py")}
    names |= {f"{module}.{name}" for name, module in PLACED.findall(mention.text)}
    return sorted(
        {name for name in names if not resolves(name)} | {path for path in paths if not exists(path, mention.file)}
    )


@pytest.mark.slow  # it imports every module that is named
def test_what_is_named_exists() -> None:
    found = [
        f"{mention.file.relative_to(ROOT)}:{mention.line}: {name}" for mention in mentions() for name in stale(mention)
    ]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("see `khala_bridge.nowhere`", ["khala_bridge.nowhere"]),
        ("`khala_protocol.messages.Observation.nothing`", ["khala_protocol.messages.Observation.nothing"]),
        ("khala_protocol.messages.Observation.text and khala_bridge.game.game are there", []),
        ("bridge/khala_bridge/data/actions/*.yaml and simulator/khala_simulator/data/tables/<version>", []),
        ("bridge/nowhere/data/*.yaml", ["bridge/nowhere/data/*.yaml"]),
        ("`nowhere.py`", ["nowhere.py"]),
        ("`Nothing` in `khala_bridge.frames`", ["khala_bridge.frames.Nothing"]),
        ("the key khala/<run>/<side> is no path", []),
    ],
)
def test_a_stale_reference_would_be_found(text: str, named: list[str]) -> None:
    assert stale(Mention(ROOT / "bridge" / "khala_bridge" / "errors.py", 1, text)) == named
