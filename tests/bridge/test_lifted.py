"""What a Phoenix holds up with its beam is hit in the air, whatever the game says of its flying."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from khala_bridge.act import Actor
from khala_bridge.observe import Observer
from khala_bridge.task.config import AgentConfig, TaskConfig
from khala_protocol.speech import parse

if TYPE_CHECKING:
    from collections.abc import Callable

    from s2clientprotocol import raw_pb2

    from khala_bridge.state import Snapshot

GRAVITON_BEAM = 5


def leader_of(unit_type: str) -> AgentConfig:
    """Return an agent whose only team is of this type, and may attack units."""
    team = {"name": "T", "unit_types": [unit_type]}
    return AgentConfig.model_validate(
        {"name": "A", "role": "", "teams": [team], "actions": {unit_type: ["Attack_Unit"]}}
    )


@pytest.mark.parametrize(
    ("attacker", "buffs", "refused"),
    [
        ("Phoenix", (), ["invalid_target"]),
        ("Phoenix", (GRAVITON_BEAM,), []),
        ("Zealot", (), []),
        ("Zealot", (GRAVITON_BEAM,), ["invalid_target"]),
    ],
)
def test_what_is_lifted_is_hit_in_the_air(
    attacker: str,
    buffs: tuple[int, ...],
    refused: list[str],
    task: Callable[..., TaskConfig],
    unit: Callable[..., raw_pb2.Unit],
    snapshot: Callable[..., Snapshot],
) -> None:
    config = task("2s3z", agents=(leader_of(attacker),))
    queen = unit(0x100180001, "Queen", 12, 10, alliance="enemy", buff_ids=buffs)
    observation = Observer(config).observe(snapshot([unit(0x100040001, attacker, 10, 10), queen]))
    joint = Actor(config).joint(observation, {"A": parse("<Attack_Unit(0x100180001)>")})
    assert [rejection.reason for rejection in joint.rejections["A"]] == refused


BEAM, SCRAMBLED = 173, 277
HOLDER, OTHER, QUEEN = 0x100040001, 0x100080001, 0x100180001


@pytest.mark.parametrize(
    ("order", "on", "buffs", "able"),
    [
        (BEAM, GRAVITON_BEAM, (), (OTHER,)),  # it holds the Queen up
        (BEAM, None, (), ()),  # it goes there; neither can hit what is on the ground
        (None, GRAVITON_BEAM, (), (HOLDER, OTHER)),  # somebody else holds her up
        (None, GRAVITON_BEAM, (SCRAMBLED,), (OTHER,)),
    ],
)
def test_a_unit_whose_weapon_is_off_attacks_nothing(
    order: int | None,
    on: int | None,
    buffs: tuple[int, ...],
    able: tuple[int, ...],
    task: Callable[..., TaskConfig],
    unit: Callable[..., raw_pb2.Unit],
    snapshot: Callable[..., Snapshot],
) -> None:
    holder = unit(HOLDER, "Phoenix", 10, 10, is_flying=True, buff_ids=buffs)
    if order is not None:
        holder.orders.add(ability_id=order, target_unit_tag=QUEEN)
    queen = unit(QUEEN, "Queen", 12, 10, alliance="enemy", buff_ids=() if on is None else (on,))
    config = task("2s3z", agents=(leader_of("Phoenix"),))
    seen = Observer(config).observe(snapshot([holder, unit(OTHER, "Phoenix", 11, 10, is_flying=True), queen]))
    joint = Actor(config).joint(seen, {"A": parse(f"<Attack_Unit({hex(QUEEN)})>")})
    assert tuple(tag for command in joint.commands for tag in command.units) == able
    assert [rejection.reason for rejection in joint.rejections["A"]] == ([] if able else ["invalid_target"])
