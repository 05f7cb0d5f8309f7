"""Judgements take their facts from the data that the map depends on, and from nowhere else."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import pytest

import khala_bridge
from khala_bridge.act import Actor
from khala_bridge.knowledge import DataSet, MapFacts, facts_of, is_structure, is_worker, race_of
from khala_bridge.observe import Observer
from khala_bridge.task.config import AgentConfig, TaskConfig
from khala_orchestrator.config import load_task
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from khala_bridge.act import JointAction
    from khala_bridge.state import Snapshot
    from khala_protocol.messages import TeamView

BRIDGE = Path(khala_bridge.__file__).parent
JUDGING = ("act", "auto", "observe", "overview", "rules", "state")
OF_LADDER_MAPS = {"knowledge", "abilities", "upgrades", "buffs", "unit_facts", "ability_facts", "upgrade_facts"}
"""Functions whose facts are those of the multiplayer's maps unless somebody says otherwise."""
CODES = "observe/image/codes.py"
"""Gives each type two letters, the same in every picture of every map."""


def _faults(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("khala_bridge.knowledge"):
            yield from (alias.name for alias in node.names if alias.name in OF_LADDER_MAPS)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "facts_of":
            yield from (f"facts_of({ast.unparse(arg)})" for arg in node.args if isinstance(arg, ast.Constant))


def test_nobody_who_judges_asks_for_the_facts_of_ladder_maps() -> None:
    files = [path for part in JUDGING for path in (BRIDGE / part).rglob("*.py")]
    assert len(files) > 80
    found = {path.relative_to(BRIDGE).as_posix(): list(_faults(path)) for path in files}
    assert {name: faults for name, faults in found.items() if faults} == {CODES: ["knowledge"]}


def test_what_a_type_is_no_data_set_changes() -> None:
    for data in get_args(DataSet):
        for name, kind in facts_of(data).units.items():
            assert (kind.race, kind.structure, kind.worker) == (race_of(name), is_structure(name), is_worker(name))
    assert not any(race_of(name) for name in facts_of("multi").upgrades)


# --- the same scene with different data -------------------------------------------------------------------------------

OWN, FOE, FLYER = 0x100040001, 0x100180001, 0x1001C0001
ATTACK = "<Attack_Unit({})>"


@pytest.fixture
def see(task: Callable[..., TaskConfig], unit: Any, snapshot: Callable[..., Snapshot]) -> Callable[..., Any]:
    """Return what a unit of a type is offered, and the judgement of its attacks, before a Queen and a Corruptor."""

    def at(unit_type: str, data: DataSet, *tags: int) -> tuple[TeamView, JointAction]:
        agent = AgentConfig.model_validate(
            {
                "name": "A",
                "role": "",
                "teams": [{"name": "T", "unit_types": [unit_type]}],
                "actions": {unit_type: ["Attack_Unit", "Move_Screen"]},
            }
        )
        config = task("2s3z", agents=(agent,), max_actions=9)
        units = [
            unit(OWN, unit_type, 10, 10),
            unit(FOE, "Queen", 12, 10, alliance="enemy"),
            unit(FLYER, "Corruptor", 13, 10, alliance="enemy", is_flying=True),
        ]
        seen = Observer(config).observe(snapshot(units, data=data))
        calls = "\n".join(ATTACK.format(hex(tag)) for tag in tags)
        return seen.agents["A"].view.teams[0], Actor(config).joint(seen, {"A": parse(f"Actions:\n{calls}")})

    return at


@pytest.mark.parametrize(("data", "targets"), [("multi", ()), ("void", (hex(FLYER),))])
def test_a_tempest_is_offered_what_its_weapons_reach_on_the_map(
    see: Callable[..., Any], data: DataSet, targets: tuple[str, ...]
) -> None:
    view, joint = see("Tempest", data, FOE)
    assert [arguments.tags for arguments in view.arguments] == [targets] * bool(targets)  # all will do, without a list
    refused = [(rejection.reason, rejection.message) for rejection in joint.rejections["A"]]
    what = f"{hex(FOE)} is a Queen on the ground, and no weapon of team T reaches that."
    assert refused == ([("invalid_target", what)] if targets else [])


@pytest.mark.parametrize(("data", "refused"), [("multi", []), ("void", ["not_available"])])
def test_a_high_templar_has_a_weapon_on_ladder_maps_alone(
    see: Callable[..., Any], data: DataSet, refused: list[str]
) -> None:
    view, joint = see("HighTemplar", data, FOE)
    assert [action.name for action in view.actions] == ["Attack_Unit", "Move_Screen"][bool(refused) :]
    assert [rejection.reason for rejection in joint.rejections["A"]] == refused


# --- a whole task -----------------------------------------------------------------------------------------------------


class _Poison(MapFacts):
    """Facts that nobody may read."""

    def __getattribute__(self, name: str) -> Any:
        raise AssertionError(f"somebody asks for {name} of the multiplayer's facts")


@pytest.mark.parametrize(("name", "data"), [("pvz_task7_level2", "void"), ("3s5z", "liberty")])
def test_a_task_on_other_data_never_reads_the_facts_of_ladder_maps(
    name: str, data: DataSet, unit: Any, snapshot: Callable[..., Snapshot], monkeypatch: pytest.MonkeyPatch
) -> None:
    config = load_task(name)
    assert config.map_data == data
    agents = config.agents
    types = list(dict.fromkeys(kind for agent in agents for team in agent.teams for kind in team.unit_types))
    own = [unit((i + 1) << 18 | 1, kind, 10 + i % 5, 10 + i // 5, energy=200.0) for i, kind in enumerate(types * 2)]
    foes = [
        unit((i + 64) << 18 | 1, kind, 12 + i, 14, alliance="enemy", is_flying=facts_of(data).units[kind].flying)
        for i, kind in enumerate(("Hydralisk", "Corruptor", "Queen", "Infestor", "Marine", "Medivac"))
    ]
    seen = snapshot([*own, *foes], data=data, player={"minerals": 500, "vespene": 500, "food_cap": 100})
    facts = facts_of("multi")
    monkeypatch.setattr(facts, "__class__", _Poison)
    calls = [f"<{action.name}({hex(foes[0].tag)})>" for action in _aimed(config)]
    observer = Observer(config)
    observation = observer.observe(seen)
    assert all(observation.agents[agent.name].text for agent in agents)
    replies = {
        name: parse("\n".join(line for team in said.teams for line in (f"Team {team.name}:", *calls)))
        for name, said in ((agent.name, observation.agents[agent.name]) for agent in agents)
    }
    joint = Actor(config).joint(observation, replies)
    assert any(joint.accepted.values())


def _aimed(config: TaskConfig) -> list[Any]:
    actions = {action.name: action for agent in config.agents for action in agent.catalogue()}
    return [action for action in actions.values() if action.target_kind == "tag" and not action.actor_count]
