"""A task of two sides from the file to the result: each side has an observer, an actor and an executor of its own."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from khala_bridge.act import Actor, executor_of
from khala_bridge.game.game import GameConfig, GameThread, Sides
from khala_bridge.game.pysc2_game import PySC2Game
from khala_bridge.observe import Observer
from khala_bridge.task.config import TaskConfig
from khala_protocol.configfile import load
from khala_protocol.speech import parse
from khala_simulator.process.install import install

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from khala_bridge.act import Command
    from khala_bridge.state import Snapshot

pytestmark = pytest.mark.game

DUELS = Path(__file__).resolve().parents[3] / "configs" / "tasks" / "duels"
TEAM = re.compile(r"^Team (\S+)\n((?: .*\n)+)", re.MULTILINE)
ENEMY = re.compile(r"\| tag (0x[0-9a-f]+) \| screen \S+ \S+ \| distance \S+ \| health (\d+)/\d+")
LIMIT = 1440
"""Game loops after which a duel is a draw."""


class Side:
    """One side's half of a turn."""

    def __init__(self, task: TaskConfig, policy: Callable[[str], str]) -> None:
        self.observer, self.actor, self._policy = Observer(task), Actor(task), policy
        self.texts: list[str] = []

    def commands(self, now: Snapshot) -> Sequence[Command]:
        observation = self.observer.observe(now, {})
        texts = {name: agent.text for name, agent in observation.agents.items()}
        self.texts += texts.values()
        replies = {name: parse(self._policy(text)) for name, text in texts.items()}
        joint = self.actor.joint(observation, replies)
        assert not any(joint.rejections.values())
        return joint.commands


def attack(text: str) -> str:
    lines = ["Actions:"]
    for name, block in TEAM.findall(text):
        seen = [(int(health), tag) for tag, health in ENEMY.findall(block)]
        lines += [f"Team {name}:", f"<Attack_Unit({min(seen)[1]})>"] if seen else []
    return "\n".join(lines)


def silent(_: str) -> str:
    return "Actions:"


@pytest.mark.slow
@pytest.mark.parametrize(("name", "executor"), [("duel_2s3z", "raw"), ("duel_8m", "raw"), ("duel_3m", "screen")])
@pytest.mark.parametrize("active", ["blue", "red"])
async def test_a_side_that_attacks_a_silent_one_brings_the_duel_to_a_result(
    name: str, executor: str, active: str, tmp_path: Path
) -> None:
    task = load(DUELS / f"{name}.yaml", TaskConfig).model_copy(update={"executor": executor})
    config = GameConfig(sc2path=install(tmp_path / "sc2"), map=task.map_spec, players=2, seed=1)
    sides = [Side(side, attack if side.side == active else silent) for side in task.per_side()]
    game = Sides(GameThread(lambda: PySC2Game(config)), [executor_of(side) for side in task.per_side()])
    async with game:
        now = await game.reset()
        while not now[0].ended:
            commands = [side.commands(snapshot) for side, snapshot in zip(sides, now, strict=True)]
            now = tuple(result.snapshot for result in await game.act(commands, 22))
    assert {snapshot.outcome for snapshot in now} == {"win", "loss"}
    assert now[0].game_loop == now[1].game_loop < LIMIT
    assert all(ENEMY.search(side.texts[0]) for side in sides), "each side has the other on its screen"
