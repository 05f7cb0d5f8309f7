"""The requests of SMAC and of SMACv2 in their own order: both kill every unit between two episodes.

SMAC waits for the units that the map makes, SMACv2 makes its own. Their packages are played whole by
`python -m bench smac` and `python -m bench smacv2`.
"""

import pytest
from s2clientprotocol import common_pb2, debug_pb2, raw_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.process.client import Client, command, interface

HEAL = 386
Value = debug_pb2.DebugSetUnitValue


def sides(client: Client) -> tuple[list[raw_pb2.Unit], list[raw_pb2.Unit]]:
    """Return the units of the player and those of the enemy."""
    units = client.observe().observation.raw_data.units
    return (
        [unit for unit in units if unit.alliance == raw_pb2.Self],
        [unit for unit in units if unit.alliance == raw_pb2.Enemy],
    )


@pytest.mark.parametrize(("name", "numbers"), [("MMM", (10, 10)), ("MMM2", (10, 12))])
def test_every_reset_brings_new_units_though_medivacs_heal_who_is_killed(name: str, numbers: tuple[int, int]) -> None:
    client = Client()
    client.play(f"SMAC_Maps/{name}", interface(screen=0))
    for _ in range(4):
        own, foes = sides(client)
        assert (len(own), len(foes)) == numbers
        assert all(unit.health == unit.health_max for unit in own + foes)
        wounded = next(unit for unit in own if not unit.energy_max)
        healers = [unit.tag for unit in own if unit.energy_max]
        low = Value(unit_value=Value.Life, unit_tag=wounded.tag, value=2.0)
        client.debug(debug_pb2.DebugCommand(unit_value=low))
        client.step()
        client.act(command(HEAL, healers, target=wounded.tag))
        client.step(8)
        (healed,) = (unit for unit in sides(client)[0] if unit.tag == wounded.tag)
        assert 2.0 < healed.health < healed.health_max
        everybody = debug_pb2.DebugKillUnit(tag=[unit.tag for unit in own + foes])
        client.debug(debug_pb2.DebugCommand(kill_unit=everybody))
        client.step(2)
        for _ in range(20):
            if tuple(map(len, sides(client))) == numbers:
                break
            client.step()
        assert not {unit.tag for unit in own + foes} & {unit.tag for side in sides(client) for unit in side}


TEAMS = {
    "Protoss": {"Stalker": 74, "Zealot": 73, "Colossus": 4},
    "Terran": {"Marine": 48, "Marauder": 51, "Medivac": 54},
    "Zerg": {"Zergling": 105, "Hydralisk": 107, "Baneling": 9},
}
OWN_TYPES = sorted(name for team in TEAMS.values() for name in team)
"""SMACv2 numbers the map's types by name, and the last of them is the last of all types."""


def make(type_id: int, owner: int, x: float, y: float) -> debug_pb2.DebugCommand:
    place = common_pb2.Point2D(x=x, y=y)
    unit = debug_pb2.DebugCreateUnit(unit_type=type_id, owner=owner, pos=place, quantity=1)
    return debug_pb2.DebugCommand(create_unit=unit)


@pytest.mark.parametrize("race", TEAMS)
def test_smacv2_makes_both_teams_and_the_enemies_come(race: str) -> None:
    client = Client()
    client.play("SMAC_Maps/32x32_flat", interface(screen=0))
    first = len(client.ask(data=sc.RequestData(unit_type_id=True)).data.units) - len(OWN_TYPES)
    for _ in range(2):
        assert sides(client) == ([], [])
        for row, (name, enemy) in enumerate(TEAMS[race].items()):
            client.debug(
                make(first + OWN_TYPES.index(name), 1, 8.0, 10.0 + 6 * row), make(enemy, 2, 26.0, 10.0 + 6 * row)
            )
        client.step()
        own, foes = sides(client)
        assert sorted(foe.unit_type for foe in foes) == sorted(TEAMS[race].values())
        numbers = {health(unit): unit.unit_type for unit in foes}
        assert {numbers[health(unit)]: unit.unit_type - first for unit in own} == {
            enemy: OWN_TYPES.index(name) for name, enemy in TEAMS[race].items()
        }
        client.step(40)
        near = {foe.unit_type: foe.pos.x for foe in sides(client)[1]}
        assert all(x < 25.0 for number, x in near.items() if number != TEAMS["Terran"]["Medivac"])
        everybody = [unit.tag for side in sides(client) for unit in side]
        client.debug(debug_pb2.DebugCommand(kill_unit=debug_pb2.DebugKillUnit(tag=everybody)))
        client.step(2)


def health(unit: raw_pb2.Unit) -> tuple[float, float, float]:
    """Return what tells the types of a race apart."""
    return unit.health_max, unit.shield_max, unit.energy_max
