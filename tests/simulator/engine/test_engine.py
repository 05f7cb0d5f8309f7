"""Each rule has one text; compiled or interpreted, games come to what was recorded before there was one."""

from __future__ import annotations

import copy
import importlib
import json
import os
import pickle
import subprocess
import sys
from importlib.machinery import EXTENSION_SUFFIXES
from typing import TYPE_CHECKING

import pytest

from bench.simulator.simulator_engine import battle
from khala_simulator import tick
from khala_simulator.native import engine
from tests.simulator.engine import recorded

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from khala_simulator.world.world import World

RECORD = json.loads(recorded.FILE.read_text(encoding="utf-8"))
SHORT = ("llm_smac/2s3z", "llm_pysc2/pvz_task6_level1")
INTERPRETED = """
import json, sys
from tests.simulator.engine import recorded
{change}
loops, names, worlds = json.loads(sys.argv[1])
games = {{name: recorded.digests(recorded.makers()[name], loops) for name in names}}
print(json.dumps([games, [recorded.random_digest(number) for number in range(worlds)]]))
"""
NO_DAMAGE = "from khala_simulator.combat import damage; damage.apply_damage = lambda *given, **more: None"

compiled = pytest.mark.skipif(
    engine.engine() == "python", reason="the rules were not compiled, or the interpreter is wanted"
)


def interpreted(
    loops: int, names: tuple[str, ...], worlds: int = 0, change: str = ""
) -> tuple[dict[str, list[str]], list[str]]:
    """Return the digests of games and of random worlds that the interpreter plays, in a process of its own."""
    command = [sys.executable, "-c", INTERPRETED.format(change=change), json.dumps([loops, names, worlds])]
    environ = {**os.environ, engine.VARIABLE: "python"}
    done = subprocess.run(command, env=environ, check=True, capture_output=True, text=True)
    games, random = json.loads(done.stdout)
    return games, random


@pytest.mark.parametrize("name", SHORT)
def test_a_game_comes_to_what_was_recorded(name: str) -> None:
    assert recorded.digests(recorded.makers()[name], 300) == RECORD["games"][name][:3]


def test_random_worlds_come_to_what_was_recorded() -> None:
    assert list(recorded.random_differences(range(12))) == []


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", recorded.makers())
def test_every_game_comes_to_what_was_recorded(name: str) -> None:
    assert recorded.digests(recorded.makers()[name]) == RECORD["games"][name]


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_thousand_random_worlds_come_to_what_was_recorded() -> None:
    assert list(recorded.random_differences(range(recorded.RANDOM_WORLDS))) == []


def test_the_interpreter_plays_the_same_game_and_its_files_are_the_rules() -> None:
    games, _ = interpreted(100, SHORT[:1])
    assert games == {name: RECORD["games"][name][:1] for name in SHORT[:1]}
    games, _ = interpreted(100, SHORT[:1], change=NO_DAMAGE)
    assert games != {name: RECORD["games"][name][:1] for name in SHORT[:1]}


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_the_interpreter_plays_the_same_games() -> None:
    names = ("llm_smac/MMM2", "llm_smac/so_many_baneling", "llm_pysc2/pvz_task6_level1", "melee/Simple64")
    games, random = interpreted(200, names, worlds=40)
    assert games == {name: RECORD["games"][name][:2] for name in names}
    assert random == RECORD["random"][:40]


@compiled
def test_every_rule_with_types_is_compiled() -> None:
    rules = engine.compiled_rules()
    assert "khala_simulator.combat.damage" in rules
    files = {name: str(importlib.import_module(name).__file__) for name in rules}
    assert {name for name, file in files.items() if not file.endswith(tuple(EXTENSION_SUFFIXES))} == set()


def test_a_rule_that_was_changed_since_it_was_compiled_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rule = tmp_path / "khala_simulator" / "systems" / "rule.py"
    rule.parent.mkdir(parents=True)
    (tmp_path / "setup.py").touch()
    monkeypatch.setattr(engine, "ROOT", tmp_path / "khala_simulator")
    built = rule.with_name(f"rule{EXTENSION_SUFFIXES[0]}")
    for file in (rule, rule.with_suffix(".pxd"), built):
        file.touch()
        os.utime(file, (1000, 1000))
    assert engine.changed_rule() is None
    os.utime(rule.with_suffix(".pxd"), (2000, 2000))
    assert engine.changed_rule() == rule.with_suffix(".pxd")
    monkeypatch.delenv(engine.VARIABLE, raising=False)
    with pytest.raises(ImportError, match=r"rule\.pxd was changed since it was compiled: say make install"):
        engine.check()


def by_pickle(world: World) -> World:
    """Return a copy that went through bytes."""
    copied: World = pickle.loads(pickle.dumps(world))
    return copied


@pytest.mark.parametrize("copied", [copy.deepcopy, by_pickle])
def test_a_copy_of_a_world_in_battle_plays_on_as_it_does(copied: Callable[[World], World]) -> None:
    world = battle("llm_smac/2s3z", 1)
    tick.advance(world, 60)
    other = copied(world)
    tick.advance(world, 60)
    tick.advance(other, 60)
    assert other.digest() == world.digest()
