"""The requests of SMAC in its own order: it kills every unit between two episodes and waits for the next ones.

Its package is played whole by `python -m bench smac`.
"""

import pytest
from s2clientprotocol import debug_pb2, raw_pb2

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
