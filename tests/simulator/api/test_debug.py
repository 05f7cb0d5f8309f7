"""Debug commands: what they do, when, and what they never break."""

from typing import Any

import pytest
from s2clientprotocol import common_pb2, debug_pb2, raw_pb2
from s2clientprotocol import sc2api_pb2 as sc

from khala_simulator.process.client import Client, command, interface

MARINE, STALKER, SENTRY = 48, 74, 77
Value = debug_pb2.DebugSetUnitValue


def make(unit_type: int, owner: int, x: float, y: float, quantity: int = 1) -> debug_pb2.DebugCommand:
    unit = debug_pb2.DebugCreateUnit(
        unit_type=unit_type, owner=owner, pos=common_pb2.Point2D(x=x, y=y), quantity=quantity
    )
    return debug_pb2.DebugCommand(create_unit=unit)


def kill(*tags: int) -> debug_pb2.DebugCommand:
    return debug_pb2.DebugCommand(kill_unit=debug_pb2.DebugKillUnit(tag=tags))


def value(kind: Any, tag: int, number: float) -> debug_pb2.DebugCommand:
    return debug_pb2.DebugCommand(unit_value=Value(unit_value=kind, unit_tag=tag, value=number))


def units(client: Client, unit_type: int) -> list[raw_pb2.Unit]:
    return [unit for unit in client.observe().observation.raw_data.units if unit.unit_type == unit_type]


@pytest.fixture
def client() -> Client:
    client = Client()
    client.play(options=interface(screen=0))
    return client


def test_units_are_made_at_the_place_and_for_the_owner(client: Client) -> None:
    client.debug(make(MARINE, 1, 4.0, 28.0, 5), make(MARINE, 16, 28.0, 28.0))
    assert not units(client, MARINE)
    client.step(2)
    assert sorted(unit.alliance for unit in units(client, MARINE)) == [raw_pb2.Self] * 5 + [raw_pb2.Neutral]


def test_a_single_unit_stands_exactly_where_it_was_made(client: Client) -> None:
    client.debug(make(SENTRY, 1, 4.25, 28.75))
    client.step()
    (sentry,) = units(client, SENTRY)
    assert (sentry.pos.x, sentry.pos.y) == (4.25, 28.75)


def test_killed_units_are_gone_after_the_next_step(client: Client) -> None:
    victims = [unit.tag for unit in units(client, STALKER)]
    client.debug(kill(*victims, 1, 2**64 - 1))
    seen = client.step(2)
    assert not set(victims) & {unit.tag for unit in seen.observation.raw_data.units}
    assert set(victims) == set(seen.observation.raw_data.event.dead_units)


@pytest.mark.parametrize(
    ("kind", "field", "number", "expected"),
    [
        (Value.Life, "health", 5, 5), (Value.Life, "health", 9999, 40),
        (Value.Shields, "shield", 7, 7), (Value.Shields, "shield", 9999, 40),
        (Value.Energy, "energy", 120, 120), (Value.Energy, "energy", 9999, 200), (Value.Energy, "energy", -5, 0),
        (Value.Energy, "energy", float("nan"), 50),
    ],
)  # fmt: skip
def test_values_are_set_within_what_the_unit_can_have(
    client: Client, kind: Any, field: str, number: float, expected: float
) -> None:
    client.debug(make(SENTRY, 1, 4.0, 28.0))
    client.step()
    (sentry,) = units(client, SENTRY)
    client.debug(value(kind, sentry.tag, number))
    client.step()
    assert getattr(units(client, SENTRY)[0], field) == pytest.approx(expected, abs=0.2)


@pytest.mark.parametrize(
    ("end", "results"),
    [
        (debug_pb2.DebugEndGame.Surrender, [sc.Defeat, sc.Victory]),
        (debug_pb2.DebugEndGame.DeclareVictory, [sc.Victory, sc.Defeat]),
    ],
)
def test_a_player_ends_the_game(client: Client, end: Any, results: list[int]) -> None:
    client.debug(debug_pb2.DebugCommand(end_game=debug_pb2.DebugEndGame(end_result=end)))
    assert client.ask(step=sc.RequestStep(count=4)).status == sc.ended
    assert [result.result for result in client.observe().player_result] == results


def test_resources_are_given(client: Client) -> None:
    client.debug(debug_pb2.DebugCommand(game_state=debug_pb2.all_resources))
    common = client.step().observation.player_common
    assert (common.minerals, common.vespene) == (5000, 5000)


def seen_share(client: Client) -> float:
    """Return the share of the map that is in sight."""
    grid = client.observe().observation.raw_data.map_state.visibility
    return grid.data.count(2) / len(grid.data)


def test_the_shown_map_stays_until_it_is_called_again() -> None:
    client = Client()
    client.play("Simple64", options=interface(screen=0))
    foes = [unit for unit in client.observe().observation.raw_data.units if unit.alliance == raw_pb2.Enemy]
    assert not foes
    client.debug(debug_pb2.DebugCommand(game_state=debug_pb2.show_map))
    for _ in range(3):
        client.step(50)
        assert seen_share(client) == 1.0
    assert [u for u in client.observe().observation.raw_data.units if u.alliance == raw_pb2.Enemy]
    client.debug(debug_pb2.DebugCommand(game_state=debug_pb2.show_map))
    client.step(20)
    assert seen_share(client) < 0.5
    assert not [u for u in client.observe().observation.raw_data.units if u.alliance == raw_pb2.Enemy and u.health]


def test_without_fog_every_neutral_unit_is_there_once() -> None:
    client = Client()
    client.create("Simple64", disable_fog=True)
    client.ask(join_game=sc.RequestJoinGame(race=common_pb2.Protoss, options=interface(screen=0)))
    units = client.observe().observation.raw_data.units
    neutral = [(unit.pos.x, unit.pos.y) for unit in units if unit.alliance == raw_pb2.Neutral]
    assert neutral
    assert len(neutral) == len(set(neutral))
    assert all(unit.display_type == raw_pb2.Visible for unit in units)


def upgrades(client: Client) -> set[int]:
    return set(client.observe().observation.raw_data.player.upgrade_ids)


def test_an_upgrade_is_one_level_at_a_time(client: Client) -> None:
    weapons, blink = [39, 40, 41], 87  # Protoss ground weapons 1 to 3
    for level in (1, 2, 3, 3):
        client.debug(debug_pb2.DebugCommand(game_state=debug_pb2.upgrade))
        client.step()
        assert [number for number in weapons if number in upgrades(client)] == weapons[:level]
        assert blink in upgrades(client)


@pytest.mark.parametrize(
    "command_",
    [
        make(999_999, 1, 5, 5), make(MARINE, 7, 5, 5), make(MARINE, -3, 5, 5), make(MARINE, 1, float("nan"), 5),
        value(Value.Life, 123, 5), kill(), debug_pb2.DebugCommand(), debug_pb2.DebugCommand(game_state=debug_pb2.god),
        debug_pb2.DebugCommand(draw=debug_pb2.DebugDraw()),
        debug_pb2.DebugCommand(score=debug_pb2.DebugSetScore(score=5)),
        debug_pb2.DebugCommand(create_unit=debug_pb2.DebugCreateUnit()),
        debug_pb2.DebugCommand(test_process=debug_pb2.DebugTestProcess(test=debug_pb2.DebugTestProcess.hang)),
    ],
)  # fmt: skip
def test_what_means_nothing_does_nothing(client: Client, command_: debug_pb2.DebugCommand) -> None:
    before = len(client.observe().observation.raw_data.units)
    client.debug(command_)
    assert len(client.step().observation.raw_data.units) == before


def test_units_made_off_the_map_stand_at_its_edge(client: Client) -> None:
    client.debug(make(MARINE, 1, -500, 90), make(MARINE, 1, 5, 5, 2**31))
    client.step()
    marines = units(client, MARINE)
    assert len(marines) == 401
    assert all(0 <= unit.pos.x <= 32 and 0 <= unit.pos.y <= 32 for unit in marines)


def test_debug_commands_and_actions_are_done_in_the_order_in_which_they_came(client: Client) -> None:
    client.debug(make(SENTRY, 1, 4.0, 28.0))
    client.step()
    (sentry,) = units(client, SENTRY)
    client.act(command(16, [sentry.tag], point=(4.0, 4.0)))
    client.debug(kill(sentry.tag))
    client.act(command(18, [sentry.tag]))
    seen = client.step(2)
    assert [action.action_raw.unit_command.ability_id for action in seen.actions] == [16, 18]
    assert not units(client, SENTRY)
