"""Two selections of matches are compared if they are alike, and refused with the fields that differ if not."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest
from scipy import stats  # type: ignore[import-untyped]
from typer.testing import CliRunner

from khala_protocol.errors import ConfigError
from khala_sc2.cli import app
from khala_sc2.experiment.compare import Compared, Findings, compare
from khala_sc2.experiment.selection import select
from tests.khala.experiment.handmade import CARD, HandMade

if TYPE_CHECKING:
    from pathlib import Path

EARLY, LATE = set(range(1, 16)), set(range(9, 21))


@pytest.fixture
def made(tmp_path: Path) -> HandMade:
    return HandMade(tmp_path / "made")


def compared(made: HandMade, **given: Any) -> Findings:
    out = made.store.directory.parent
    return compare(select("made:player=skilled", out), select("made:player=focus", out), **given)


def one(findings: Findings, measure: str = "win") -> Compared:
    return next(one for one in findings.compared if one.measure == measure)


def refusal(made: HandMade, a: str = "made:player=skilled", b: str = "made:player=focus", **given: Any) -> str:
    out = made.store.directory.parent
    with pytest.raises(ConfigError) as caught:
        compare(select(a, out), select(b, out), **given)
    return str(caught.value)


def test_wins_with_the_same_seeds_are_paired(made: HandMade) -> None:
    made.fill({"skilled": EARLY, "focus": LATE})
    found = one(compared(made))
    p = stats.binomtest(len(EARLY - LATE), len(EARLY ^ LATE)).pvalue
    assert found.test is not None
    assert (found.paired, found.games) == (True, 20)
    assert found.test.p == pytest.approx(p)
    assert (found.a.value, found.b.value) == (15 / 20, 12 / 20)


def test_kd_and_other_numbers_are_compared_too_and_all_tests_are_corrected(made: HandMade) -> None:
    made.fill({"skilled": EARLY, "focus": LATE}, accepted=7)
    findings = compared(made, measures=["win", "kd", "accepted"])
    assert [one.measure for one in findings.compared] == ["win", "kd", "accepted"]
    assert all(one.test and one.p_holm is not None and one.p_holm >= one.test.p for one in findings.compared)
    same = one(findings, "accepted")
    assert same.test is not None
    assert (same.test.effect.value, same.test.p) == (0, 1)


def test_games_without_a_partner_are_counted_and_not_used(made: HandMade) -> None:
    made.fill({"skilled": EARLY}, 20)
    made.fill({"focus": LATE}, 15)
    made.fill({"focus": LATE}, 3, task="3s5z")
    findings = compared(made)
    assert (one(findings).games, findings.unpaired, findings.not_shared) == (15, (5, 3), ("3s5z",))


def test_without_any_pair_all_games_are_compared(made: HandMade) -> None:
    for seed in range(1, 11):
        made.add({"task": "2s3z", "player": "skilled"}, seed, "win")
        made.add({"task": "2s3z", "player": "focus"}, seed + 10, "win" if seed < 4 else "loss")
    findings = compared(made)
    win, kd = one(findings), one(findings, "kd")
    assert win.test is not None
    assert (win.paired, win.games, win.test.test) == (False, 10, "Boschloo's exact test")
    assert kd.test is None
    assert kd.p_holm is None


def test_matches_that_are_not_valid_or_crashed_are_left_out_and_counted(made: HandMade) -> None:
    made.fill({"skilled": EARLY, "focus": LATE}, 10)
    made.add({"task": "2s3z", "player": "skilled"}, 1, state="invalid", cause="model away")
    made.add({"task": "2s3z", "player": "focus"}, 2, state="crashed", cause="timeout")
    findings = compared(made)
    assert (one(findings).games, findings.left_out) == (8, ({"invalid": 1}, {"crashed": 1}))


def test_games_that_are_still_needed_are_said(made: HandMade) -> None:
    made.fill({"skilled": {1, 2, 3, 4}, "focus": {4}}, 10)
    found = one(compared(made))
    assert found.games_for_power is not None
    assert 10 < found.games_for_power < 60
    made.fill({"skilled": set(range(1, 11)), "focus": set()}, 10)
    assert one(compared(made)).games_for_power is None


@pytest.mark.parametrize(
    ("card", "words"),
    [
        ({"map": "2s3z " + "1" * 64}, "map is 2s3z 000000000000 in A, 2s3z 111111111111 in B"),
        ({"game": "StarCraft II 4.10"}, "game is Khala simulator 0.1.0, as 4.10.0.75689 in A, StarCraft II 4.10 in B"),
        ({"opponent": "nobody"}, "opponent is computer (protoss, very_hard) in A, nobody in B"),
        ({"executor": "screen"}, "executor is raw in A, screen in B"),
        ({"clock": CARD["clock"] | {"max_wait_s": 30.0}}, "clock.max_wait_s is 15.0 in A, 30.0 in B"),
        ({"actions": "b" * 64}, "actions is aaaaaaaaaaaa in A, bbbbbbbbbbbb in B"),
        ({"code": "d" * 64}, "code is cccccccccccc in A, dddddddddddd in B"),
        ({"versions": {"khala": "0.2.0"}}, "versions.khala is 0.1.0 in A, 0.2.0 in B"),
        ({"task": CARD["task"] | {"max_actions": 5}}, "task.max_actions is 3 in A, 5 in B"),
    ],
)
def test_unlike_runs_are_refused_unless_the_difference_is_allowed(
    made: HandMade, card: dict[str, Any], words: str
) -> None:
    made.fill({"skilled": EARLY}, 5)
    made.fill({"focus": LATE}, 5, card=card)
    field = words.partition(" ")[0].partition(".")[0]
    assert refusal(made) == (
        f"made:player=skilled (A) and made:player=focus (B) are not alike: {words}. --allow {field} compares them "
        "nevertheless"
    )
    assert [str(one) for one in compared(made, allow=[field]).allowed] == [words]


def test_hardware_counts_only_when_the_wall_clock_does(made: HandMade) -> None:
    made.fill({"skilled": EARLY}, 5)
    made.fill({"focus": LATE}, 5, card={"hardware": {"cores": 4}})
    assert not compared(made).allowed
    clock = CARD["clock"] | {"rule": "realtime"}
    made.fill({"skilled": EARLY}, 5, card={"clock": clock})
    made.fill({"focus": LATE}, 5, card={"clock": clock, "hardware": {"cores": 4}})
    assert "hardware.cores is 2 in A, 4 in B" in refusal(made)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"a": "made:player=skiled"}, "no match has player 'skiled', did you mean skilled?; there are skilled, focus"),
        ({"a": "made:players=skilled"}, "there is no factor 'players', did you mean player?; there are task, player"),
        ({"a": "made"}, "made has two matches of task 2s3z with seed 1: name one value, as made:player=skilled"),
        ({"a": "gone"}, "`khala experiment run FILE` begins one"),
        ({"measures": ["wins"]}, "there is no measure 'wins': give one of win,"),
        ({"allow": ["clok"]}, "there is no field 'clok': give one of map, game"),
    ],
)
def test_a_wrong_word_is_answered_with_what_there_is(made: HandMade, given: dict[str, Any], words: str) -> None:
    made.fill({"skilled": EARLY, "focus": LATE}, 3)
    assert words in refusal(made, **given)


def test_tasks_without_a_common_one_are_refused(made: HandMade) -> None:
    made.fill({"skilled": EARLY}, 3)
    made.fill({"focus": LATE}, 3, task="3s5z")
    assert "have no match in common: 2s3z and 3s5z" in refusal(made)


def test_a_duel_needs_the_name_of_a_side(made: HandMade) -> None:
    for seed in range(1, 6):
        made.duel({"task": "2s3z"}, seed, winner="blue")
    assert "name one, as made:side=blue" in refusal(made, "made", "made")
    out = made.store.directory.parent
    found = one(compare(select("made:side=blue", out), select("made:side=red", out)))
    assert (found.a.value, found.b.value, found.paired) == (1, 0, True)


def test_the_command_prints_a_table_or_json_and_fails_when_runs_are_unlike(
    made: HandMade, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)  # a row is whole where nothing says how wide the terminal is
    made.fill({"skilled": EARLY}, 20)
    made.fill({"focus": LATE}, 20, card={"code": "d" * 64})
    command = ["experiment", "compare", "made:player=skilled", "made:player=focus"]
    command += ["--out", str(made.store.directory.parent)]
    unlike = CliRunner().invoke(app, command)
    assert isinstance(unlike.exception, ConfigError)
    printed = CliRunner().invoke(app, [*command, "--allow", "code"]).stdout
    assert "75 % (53\N{EN DASH}89)" in printed
    assert "They differ, which was allowed: code is" in printed
    data = json.loads(CliRunner().invoke(app, [*command, "--allow", "code", "--json"]).stdout)
    assert [one["measure"] for one in data["compared"]] == ["win", "kd"]
