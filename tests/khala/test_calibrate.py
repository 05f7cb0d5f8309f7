"""`khala calibrate`: probes play, files compare, estimates name their probes."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from khala_bridge.calibrate.catalogue import PROBES, choose
from khala_bridge.calibrate.record import Calibration, Measured, Values, load
from khala_bridge.calibrate.run import play
from khala_bridge.knowledge.facts import VERSION, unit_facts
from khala_protocol.errors import ConfigError
from khala_sc2.calibrate import commands, report
from khala_sc2.calibrate.compare import MOST_COMPARISONS, compare
from khala_sc2.calibrate.estimates import estimates, of_maps
from khala_sc2.cli import main
from khala_simulator.process.client import Client
from khala_simulator.process.session import Session
from khala_simulator.tables.catalog import load_catalog
from khala_simulator.tables.mechanics import entries

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from pathlib import Path

    from khala_bridge.calibrate.probe import Probe
    from khala_simulator.tables.records import UnitType

IDS = {probe.id for probe in PROBES}
CHEAP = ("move.speed", "weapon.dead_attacker", "crowd.hover", "spell.knockback")
"""Of exact and of random ones, of one setting: a game is begun once."""
WHOLE_S = 900


class InProcess:
    """A connection to the simulator without a process and without a socket."""

    def __init__(self, build: int = 75689) -> None:
        self._client = Client(Session(data_dir=".", base_build=build))

    def send(self, **request: Any) -> Any:
        (kind,) = request
        return getattr(self._client.ask(**request), kind)


def blank(seed: int = 1, **changes: Any) -> Calibration:
    told = {
        "khala": "0", "game": "simulator", "version": "4.10.0", "build": 75689, "data_version": "X",
        "platform": "Linux", "seed": seed,
    }  # fmt: skip
    return Calibration(**(told | changes))


def played(probes: Sequence[Probe], seed: int = 1, build: int = 75689) -> Calibration:
    return play(InProcess(build), probes, blank(seed), save=lambda _: None, watch=lambda *_: None)


def measured(values: dict[str, Iterable[float]], *, exact: bool = True, resolution: float = 0.0) -> Measured:
    found = {name: Values.of(some) for name, some in values.items()}
    return Measured(unit="loops", exact=exact, resolution=resolution, run_s=0.1, loops=1, values=found)


def chosen(*patterns: str) -> list[Probe]:
    return choose(patterns)


@pytest.fixture(scope="module")
def first() -> Calibration:
    return played(chosen(*CHEAP))


def test_probes_measure_what_the_tables_of_the_simulator_say(first: Calibration) -> None:
    speeds = first.probes["move.speed"].values
    table = {unit.name: unit.speed_n * 1.4 for unit in load_catalog().units}
    assert {kind: speeds[kind].mean for kind in ("Marine", "Overlord", "Hellion")} == pytest.approx(
        {kind: table[kind] for kind in ("Marine", "Overlord", "Hellion")}, abs=0.005
    )
    assert not [name for name, one in first.probes.items() if one.failed or not one.values]
    assert first.probes["weapon.dead_attacker"].values["Zealot"].mean < 16  # its second hit does not come


@pytest.mark.slow
def test_two_runs_differ_in_nothing_beyond_chance_and_with_the_same_seed_in_nothing(first: Calibration) -> None:
    again, other = played(chosen(*CHEAP)), played(chosen(*CHEAP), seed=2)
    assert {name: one.values for name, one in again.probes.items()} == {
        name: one.values for name, one in first.probes.items()
    }
    found = compare(first, other)
    assert (found.differences, found.missing, found.not_compared) == ((), (), {})
    assert found.exact > 60
    assert found.random >= 9


def test_a_comparison_finds_what_differs_and_by_how_much(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    a = blank().with_probe("move.speed", measured({"Marine": [3.15], "Probe": [3.94], "Old": [1]}, resolution=0.005))
    b = blank().with_probe("move.speed", measured({"Marine": [3.152], "Probe": [3.50], "New": [1]}, resolution=0.005))
    a = a.with_probe("weapon.period", measured({"Marine": range(10, 20), "Ghost": range(8)}, exact=False))
    b = b.with_probe("weapon.period", measured({"Marine": range(30, 40), "Ghost": range(1, 9)}, exact=False))
    found = compare(a, b)
    assert [(one.probe, one.name) for one in found.differences] == [
        ("move.speed", "Probe"),
        ("weapon.period", "Marine"),
    ]
    effect = found.differences[1].test
    assert effect is not None
    assert effect.effect.value == 20
    assert effect.effect.low > 15
    assert {(one.name, one.only_in_a) for one in found.missing} == {("Old", True), ("New", False)}
    text = report.write(a, b, found)
    assert "**2 differ.**" in text
    assert "| Probe | 3.94 | 3.5 | −0.44 |" in text
    assert "weapon_delay" in text, "the estimate that the probe settles"
    a.save(tmp_path / "a.json")
    b.save(tmp_path / "b.json")
    commands.show_comparison(tmp_path / "a.json", tmp_path / "b.json", as_json=True)
    assert [one["b"]["mean"] for one in json.loads(capsys.readouterr().out)["differences"]] == [3.5, 34.5]


@pytest.mark.parametrize(
    ("probe", "of_unit"),
    [
        ("move.speed", lambda unit: unit.speed_n * 1.4),
        pytest.param("vision.radius", lambda unit: unit.sight, marks=pytest.mark.slow),
    ],
)
def test_two_versions_differ_in_what_the_patch_changed_and_in_nothing_else(
    probe: str, of_unit: Callable[[UnitType], float]
) -> None:
    old, new = load_catalog("4.10"), load_catalog("5.0.13")
    a, b = played(chosen(probe)), played(chosen(probe), build=92440)
    found = compare(a, b)
    ids = {name: unit_facts(VERSION)[name].id for name in a.probes[probe].values if name in b.probes[probe].values}
    changed = {name for name, one in ids.items() if abs(of_unit(old.unit(one)) - of_unit(new.unit(one))) > 0.005}
    assert {one.name for one in found.differences} == changed
    assert "BroodLord" in changed or probe != "move.speed"
    assert found.exact > 60


@pytest.mark.slow
def test_two_versions_differ_in_the_damage_of_types_that_the_patch_changed_only() -> None:
    """A pair may differ by either side: its weapons, or its armor, life, attributes and plane."""
    old, new = load_catalog("4.10"), load_catalog("5.0.13")
    found = compare(played(chosen("damage.pair")), played(chosen("damage.pair"), build=92440))

    def same(name: str) -> bool:
        a, b = (catalog.unit(unit_facts(VERSION)[name].id) for catalog in (old, new))
        fields = ("armor", "attributes", "life", "shields", "shield_armor", "radius")
        weapons = [[replace(weapon, row=0) for weapon in unit.weapons] for unit in (a, b)]
        return weapons[0] == weapons[1] and all(getattr(a, name) == getattr(b, name) for name in fields)

    assert found.differences
    assert [one.name for one in found.differences if all(map(same, one.name.split(" > ")))] == []


@pytest.mark.slow
def test_every_random_measurement_can_be_found_to_differ() -> None:
    """Holm's correction divides the level by their number, and a permutation test has a least p."""
    same = {str(i): (0, 1, 0, 1, 0, 1) for i in range(1, MOST_COMPARISONS)}
    a = blank().with_probe("x", measured({"0": range(8), **same}, exact=False))
    b = blank().with_probe("x", measured({"0": range(90, 98), **same}, exact=False))
    assert [one.name for one in compare(a, b).differences] == ["0"]


def test_a_probe_that_fails_is_written_down_and_the_next_one_plays() -> None:
    speed, broken = chosen("move.speed")[0], replace(chosen("spell.knockback")[0], play=_fails)
    found = played([broken, speed])
    assert found.probes[broken.id].failed == "KeyError: 'no such unit'"
    assert found.probes["move.speed"].values
    again = play(InProcess(), [chosen("spell.knockback")[0], speed], found, save=lambda _: None, watch=lambda *_: None)
    assert not again.probes[broken.id].failed
    assert again.probes["move.speed"] is found.probes["move.speed"], "what was measured is not measured again"


def _fails(_: object) -> Any:
    raise KeyError("no such unit")


def test_every_estimate_of_the_simulator_names_a_probe_or_says_why_there_is_none() -> None:
    assert {one.probe for one in estimates() if one.probe} <= IDS
    assert [one for one in estimates() if not one.probe and len(one.because) < 10] == []
    assert [one.name for one in entries() if (one.source == "estimate") is not bool(one.probe)] == []
    assert len(of_maps()) > 10


def test_ids_are_unique_and_patterns_choose() -> None:
    assert len(IDS) == len(PROBES)
    assert {one.id for one in chosen("move.*")} == {name for name in IDS if name.startswith("move.")}
    with pytest.raises(ConfigError, match="no probe 'mov'"):
        chosen("mov")


def test_a_file_is_read_as_it_was_written(tmp_path: Path, first: Calibration) -> None:
    first.save(tmp_path / "a.json")
    assert load(tmp_path / "a.json") == first
    (tmp_path / "b.json").write_text('{"kind": "something"}')
    with pytest.raises(ConfigError, match="not a file of `khala calibrate`"):
        load(tmp_path / "b.json")


@pytest.mark.game
def test_the_command_measures_resumes_and_compares(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "found.json"
    main_ok("calibrate", "--out", str(out), "--only", "move.stop")
    assert load(out).build == 75689
    with pytest.raises(SystemExit):
        main(["calibrate", "--out", str(out)])
    assert "--resume continues it" in capsys.readouterr().err
    main_ok("calibrate", "--out", str(out), "--only", "move.st*", "--resume")
    assert set(load(out).probes) == {"move.start", "move.stop"}
    capsys.readouterr()
    main_ok("calibrate", "--compare", str(out), str(out), "--json")
    assert json.loads(capsys.readouterr().out)["differences"] == []


def main_ok(*arguments: str) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert not ended.value.code


def test_the_list_says_what_each_probe_settles(capsys: pytest.CaptureFixture[str]) -> None:
    commands.show_probes((), as_json=True)
    rows = json.loads(capsys.readouterr().out)
    assert {row["id"] for row in rows} == IDS
    assert next(row for row in rows if row["id"] == "weapon.bunker")["estimates"]


DRAWN = {
    ("weapon.interrupted", "Zealot"),
    ("damage.splash", "Colossus beside 0.00"),
    ("damage.splash", "Ultralisk behind 0.75"),  # the edge of its cleave: a matter of its facing
    ("damage.splash", "Ultralisk beside 0.75"),
    ("spell.delay", "Graviton Beam at 6.5"),
}
"""Numbers of one sample, which the random delay or facing of a weapon's holder moves."""


@pytest.mark.slow
@pytest.mark.timeout(WHOLE_S)
def test_a_third_of_the_probes_find_hardly_any_difference_between_two_seeds() -> None:
    probes = [one for one in PROBES[::3] if one.id != "opponent.growth"]  # eighty whole games
    found = compare(played(probes), played(probes, seed=2))
    assert {(one.probe, one.name) for one in found.differences} <= DRAWN
    assert (found.missing, found.not_compared) == ((), {})
