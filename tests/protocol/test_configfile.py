"""The errors that a user reads when a YAML file is wrong."""

from __future__ import annotations

import os
import time
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import pytest
from pydantic import BaseModel, ConfigDict, Field, field_validator

from khala_protocol.configfile import UnknownName, load, loads
from khala_protocol.errors import ConfigError

if TYPE_CHECKING:
    from pathlib import Path


class Team(BaseModel):
    model_config = ConfigDict(extra="forbid")
    name: str
    size: int = Field(default=1, ge=1)


class Match(BaseModel):
    model_config = ConfigDict(extra="forbid")
    task: str
    clock: Literal["frozen", "token"] = "frozen"
    teams: list[Team] = []
    limits: dict[str, float] = {}
    best: Team | None = None

    @field_validator("task")
    @classmethod
    def known_task(cls, value: str) -> str:
        if value == "unknown":
            raise ValueError("there is no task of this name")
        return value


GOOD = """
task: 2s3z
teams:
  - name: A
  - {name: B, size: 3}
limits: {usd: 1.5}
"""


def test_a_file_becomes_its_model(tmp_path: Path) -> None:
    path = tmp_path / "match.yaml"
    path.write_text(GOOD, encoding="utf-8")
    assert load(path, Match) == Match(task="2s3z", teams=[Team(name="A"), Team(name="B", size=3)], limits={"usd": 1.5})


def test_anchors_and_merges_are_read() -> None:
    text = "task: x\nbest: &b {name: A, size: 2}\nteams:\n  - *b\n  - <<: *b\n    size: 5\n"
    assert loads(text, Match, source="m").teams == [Team(name="A", size=2), Team(name="A", size=5)]


ERRORS = [
    ("task: [", "m.yaml:1: this is not YAML: did not find expected node content"),
    ("task: !!python/x y",
     "m.yaml:1: this is not YAML: could not determine a constructor for the tag 'tag:yaml.org,2002:python/x'"),
    ("task: x\n\ttab: 1", "m.yaml:2: this is not YAML: found a tab character that violates indentation"),
    ("", "m.yaml:1 (task): is required and not given"),
    ("- a", "m.yaml:1: fields are wanted here, not ['a']"),
    ("task: x\nteems: []", "m.yaml:2 (teems): no such field, did you mean 'teams'?"),
    ("task: x\nsk-secret: 1", "m.yaml:2 (sk-secret): no such field; known are best, clock, limits, task, teams"),
    ("task: x\nclock: fast", "m.yaml:2 (clock): 'fast' is none of 'frozen' or 'token'"),
    ("task: x\nteams:\n  - name: A\n    size: 0",
     "m.yaml:4 (teams.0.size): input should be greater than or equal to 1, not 0"),
    ("task: x\nteams:\n  - size: 2", "m.yaml:3 (teams.0.name): is required and not given"),
    ("task: x\nbest:\n  name: A\n  sise: 1", "m.yaml:4 (best.sise): no such field"),
    ("task: x\nlimits:\n  usd: much",
     "m.yaml:3 (limits.usd): input should be a valid number, unable to parse string as a number, not 'much'"),
    ("task: unknown", "m.yaml:1 (task): there is no task of this name"),
    ("task: x\ntask: y", "m.yaml:2 (task): is given a second time, the first is on line 1"),
    ("task: 1\nclock: 2", "m.yaml:1 (task): input should be a valid string, not 1 (and 1 more)"),
    ("task: x\nbest: {name: *a}", "m.yaml:2: this is not YAML: found undefined alias 'a'"),
    ("task: x\nlimits: &a\n  more: *a", "m.yaml:3: nested too deep"),
    ("task: x\nlimits: &a\n  <<: *a", "m.yaml:2: nested too deep"),
    ("task: x\nlimits: {<<: 3}", "m.yaml:2: only fields can be merged by <<"),
    ("task: x\n---\ntask: y", "m.yaml:2: this is not YAML: a second document begins here"),
    ("task: x\nlimits:\n  [usd]: 1", "m.yaml:3: write the name of a field here, not a list or fields"),
    ("task: x\n" + "k" * 300 + ": 1", "m.yaml:2: the name of a field has at most 200 characters, this has 300"),
    ("task: x\nlimits: {usd: " + "9" * 5000 + "}", f"m.yaml:2: '{'9' * 56}… is too long for int"),
    ("task: 2026-02-31", "m.yaml:1: '2026-02-31' is no timestamp; put it in quotes if it is a text"),
    ("task: !!bool 7", "m.yaml:1: '7' is no bool; put it in quotes if it is a text"),
    ("task: x\nlimits: " + "[" * 3000, "m.yaml:2: nested too deep"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "expected"), ERRORS)
def test_an_error_says_file_line_field_and_what_is_wrong(text: str, expected: str) -> None:
    with pytest.raises(ConfigError) as caught:
        loads(text, Match, source="m.yaml")
    assert str(caught.value) == expected


BOMBS = {
    "lists": "\n".join(f"{c}: &{c} [{', '.join([f'*{b}'] * 9)}]" for b, c in pairwise("abcdefghij")),
    "fields": "\n".join(
        f"{c}: &{c} {{{', '.join(f'k{i}: *{b}' for i in range(9))}}}" for b, c in pairwise("abcdefghij")
    ),
    "merges": "\n".join(f"{c}: &{c} {{<<: [{', '.join([f'*{b}'] * 9)}]}}" for b, c in pairwise("abcdefghij")),
    "wide": "task: [" + "a," * 40_000 + "]",
}


@pytest.mark.parametrize("kind", BOMBS)
def test_a_text_that_unfolds_to_millions_of_values_is_refused_at_once(kind: str) -> None:
    began = time.process_time()
    with pytest.raises(ConfigError, match=r"m\.yaml:\d+: there are more than 5000 values here"):
        loads(f"a: &a {{x: 1}}\n{BOMBS[kind]}\n", Match, source="m.yaml")
    assert time.process_time() - began < 1.0  # 0.05 s on an idle machine; to unfold it would take minutes


class Named(BaseModel):
    names: list[str]

    @field_validator("names")
    @classmethod
    def known(cls, names: list[str]) -> list[str]:
        raise UnknownName("unit", names[0], [f"Stalker{number}" for number in range(1000)])


def test_the_nearest_name_is_looked_for_when_the_error_is_shown() -> None:
    with pytest.raises(ConfigError) as caught:
        loads("names: [Stalkr7]", Named, source="m.yaml")
    assert str(caught.value) == "m.yaml:1 (names): there is no unit 'Stalkr7', did you mean 'Stalker7'?"
    with pytest.raises(ConfigError) as caught:
        loads(f"names: [{'x' * 5000}]", Named, source="m.yaml")
    assert str(caught.value) == f"m.yaml:1 (names): there is no unit '{'x' * 56}…"


@pytest.mark.parametrize(("text", "code"), [("task: x\nteams: \0", "0000"), ("task: x\nteams: \x1b", "001B")])
def test_a_control_character_is_refused_with_its_line(text: str, code: str) -> None:
    with pytest.raises(ConfigError) as caught:
        loads(text, Match, source="m.yaml")
    assert str(caught.value) == f"m.yaml:2: this is not YAML: the character U+{code} is not allowed"


@pytest.mark.posix
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("big.yaml", "cannot be read: it is larger than 1 MB"),
        ("pipe.yaml", "cannot be read: it is a pipe or a device: name a file"),
        ("none.yaml", "there is no such file"),
        ("folder.yaml", "this is a directory: name a YAML file"),
        ("latin.yaml", "this is not UTF-8 text"),
    ],
)
def test_a_file_that_cannot_be_read_is_named(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / "latin.yaml").write_bytes(b"task: \xe9")
    (tmp_path / "folder.yaml").mkdir()
    (tmp_path / "big.yaml").write_bytes(b"#" * (2**20 + 1))
    os.mkfifo(tmp_path / "pipe.yaml")
    path = tmp_path / name
    with pytest.raises(ConfigError) as caught:
        load(path, Match)
    assert str(caught.value) == f"{path}: {text}"


# --- files that extend others ---------------------------------------------------------------------------------


def written(directory: Path, **files: str) -> Path:
    """Write files, and return the path of the last one."""
    for name, text in files.items():
        (directory / f"{name}.yaml").write_text(text, encoding="utf-8")
    return directory / f"{name}.yaml"


def test_a_file_has_all_of_the_one_that_it_extends_but_what_it_gives_itself(tmp_path: Path) -> None:
    path = written(tmp_path, a=GOOD, b="extends: a\nclock: token\n", c="extends: b.yaml\nteams: [{name: C}]\n")
    assert load(path, Match) == Match(task="2s3z", clock="token", teams=[Team(name="C")], limits={"usd": 1.5})


def test_an_entry_takes_what_it_leaves_out_from_the_one_of_its_name(tmp_path: Path) -> None:
    path = written(
        tmp_path, a=GOOD, b="extends: a\nteams: [{name: B}, {name: C}]\n", c="extends: b\nteams: [{name: B}]"
    )
    assert load(path.with_name("b.yaml"), Match).teams == [Team(name="B", size=3), Team(name="C")]
    assert load(path, Match).teams == [Team(name="B", size=3)]


EXTENDS_ERRORS = [
    ({"b": "\nextends: a\n"}, "b.yaml:2 (extends): there is no file a.yaml for it"),
    ({"b": "extends: b\n"}, "b.yaml:1 (extends): this file extends itself"),
    ({"a": "extends: b\n", "b": "extends: a\n"}, "a.yaml:1 (extends): this file extends itself"),
    ({"a": "clock: token\nteams: [{name: A, size: 0}]\n", "b": "task: x\nextends: a\n"},
     "a.yaml:2 (teams.0.size): input should be greater than or equal to 1, not 0"),
    ({"a": "task: x\nteams:\n- name: A\n- {name: B, size: 0}\n", "b": "extends: a\nteams: [{name: B}]\n"},
     "a.yaml:4 (teams.0.size): input should be greater than or equal to 1, not 0"),
    ({"a": GOOD, "b": "extends: a\nteams:\n- name: A\n- {name: B, size: 0}\n"},
     "b.yaml:4 (teams.1.size): input should be greater than or equal to 1, not 0"),
    ({"a": GOOD, "b": "extends: a\n\ntask: unknown\n"}, "b.yaml:3 (task): there is no task of this name"),
    ({"a": "task: unknown\n", "b": "extends: a\nclock: slow\n"},
     "b.yaml:2 (clock): 'slow' is none of 'frozen' or 'token' (and 1 more)"),
    ({"b": 'extends: "a\\0"'},
     "b.yaml:1 (extends): the file for it cannot be read: its name has a character that no file name has"),
    ({"b": f"extends: {'a' * 300}"}, "b.yaml:1 (extends): the file for it cannot be read: File name too long"),
    ({f"f{i}": f"extends: f{i - 1}" for i in range(1, 40)},
     "f24.yaml:1 (extends): more than 16 files extend each other here"),
    ({"a": "clock: token\n", "b": "extends: a\n"}, "b.yaml:1 (task): is required and not given"),
]  # fmt: skip


@pytest.mark.parametrize(("files", "sentence"), EXTENDS_ERRORS, ids=[sentence for _, sentence in EXTENDS_ERRORS])
def test_an_error_names_the_file_that_it_is_in(files: dict[str, str], sentence: str, tmp_path: Path) -> None:
    path = written(tmp_path, **files)
    with pytest.raises(ConfigError) as error:
        load(path, Match)
    assert str(error.value).removeprefix(f"{tmp_path}/") == sentence


def test_a_text_without_a_file_can_extend_nothing() -> None:
    with pytest.raises(ConfigError, match="no such field"):
        loads("extends: a\ntask: x\n", Match, source="m")
