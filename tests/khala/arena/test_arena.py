"""An arena: its file, who meets whom, what is played once, ratings of several files, and the site."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import yaml

from khala_protocol.errors import ConfigError
from khala_sc2.arena import commands
from khala_sc2.arena.leaderboard import remarks_of
from khala_sc2.arena.matches import plan_round, tasks_of
from khala_sc2.arena.pairing import pair_swiss
from khala_sc2.arena.ratings import ELO, distinct_games, rate
from khala_sc2.arena.results import RESULTS, ArenaGame, ArenaResults, PoolPlayer, pool_results, write_results
from khala_sc2.arena.spec import Arena
from khala_sc2.cli import main
from tests.khala.experiment.made import MadeEngine

if TYPE_CHECKING:
    from pathlib import Path

    from khala_sc2.arena.ratings import Leaderboard
    from khala_sc2.playing.jobs import Job

MODELS = [{"name": name, "model": name} for name in ("skilled", "focus-fire", "silent")]
GROUPS = {"duels": ["duel_3m"], "battles": ["2s3z"], "full games": ["simple64_eceb_terran"]}


def arena(**fields: Any) -> Arena:
    players = [*MODELS, {"name": "easy", "level": "easy"}]
    given = {"name": "a", "players": players, "groups": GROUPS, "anchors": {"silent": 1000}, "rounds": 2}
    return Arena.model_validate(given | fields)


def game(first: str, second: str, outcome: str, **fields: Any) -> ArenaGame:
    number = fields.setdefault("seed", 1)
    key = hashlib.sha256(f"{first} {second} {number} {fields.get('task')}".encode()).hexdigest()[:16]
    given = {"match": key, "group": "duels", "task": "duel_3m", "cause": "enemy defeated", "clock": "frozen",
             "steps": 10 + number, "game_s": 5.0, "killed": 150.0, "lost": 50.0, "card": "0" * 12,
             "recording": f"matches/{key}/recording.mcap"}  # fmt: skip
    seats = {"first": {"player": first}, "second": {"player": second} | fields.pop("of_second", {})}
    return ArenaGame.model_validate(given | seats | {"outcome": outcome} | fields)


def results(*games: ArenaGame, **fields: Any) -> ArenaResults:
    names = {seat.player for found in games for seat in (found.first, found.second)}
    players = {name: PoolPlayer(kind="model", about=name, identity="0" * 16) for name in sorted(names)}
    given = {"arena": "a", "anchors": {"a": 1000.0}, "players": players, "cards": {}, "games": games}
    return ArenaResults(**(given | fields))


# --- the file and the pairing ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fields", "complaint"),
    [
        ({"anchors": {"nobody": 1}}, "the anchor nobody is no player; the players are skilled"),
        ({"players": [*MODELS, MODELS[0]]}, "there are two players skilled"),
        ({"players": [*MODELS, {"name": "x", "model": "m", "level": "easy"}]}, "x needs a model, a level or a guest"),
        ({"groups": {"overall": ["duel_3m"]}}, "the group overall is the mean of all groups"),
        ({"groups": {"a": ["duel_3m"], "b": ["duel_3m"]}}, "the task duel_3m is there twice"),
        ({"fixed": {"model": "skilled"}}, "fixed has model, which players and groups say"),
    ],
)
def test_a_mistake_in_the_file_is_named(fields: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        arena(**fields)


def test_models_meet_each_other_in_duels_the_map_in_battles_and_levels_in_full_games() -> None:
    duel, battle, full = tasks_of(arena())
    assert duel.pairs == (("skilled", "focus-fire"), ("skilled", "silent"), ("focus-fire", "silent"))
    assert duel.ways(("skilled", "silent")) == [("skilled", "silent"), ("silent", "skilled")]
    assert battle.pairs == tuple((name, "map-2s3z") for name in ("skilled", "focus-fire", "silent"))
    assert full.pairs == tuple((name, "easy") for name in ("skilled", "focus-fire", "silent"))
    assert full.ways(("skilled", "easy")) == [("skilled", "easy")]


def test_a_task_on_which_nobody_can_meet_is_refused() -> None:
    with pytest.raises(ConfigError, match="nobody can meet on the task simple64_eceb_terran"):
        tasks_of(arena(players=MODELS))


def test_a_match_plays_who_sits_where_and_a_level_is_the_opponent() -> None:
    matches = plan_round(arena(), 2, met={}, ratings={}, game="simulator")
    assert len({match.key for match in matches}) == len(matches) == 3 * 2 + 3 + 3
    assert {match.seed for match in matches} == {2}
    duel = next(match for match in matches if match.cell["first"] == "silent" and match.cell["task"] == "duel_3m")
    assert [mind.policy for mind in duel.minds.values()] == ["silent", duel.cell["second"]]
    full = next(match for match in matches if match.cell["second"] == "easy")
    assert full.config.task.opponent.difficulty == "easy"


def test_a_guest_is_started_by_its_command() -> None:
    players = [MODELS[0], {"name": "bot", "guest": "python 'my bot/run.py'"}]
    found = arena(players=players, groups={"full games": ["simple64_eceb_terran"]}, anchors={"bot": 1})
    (match,) = plan_round(found, 1, met={}, ratings={}, game="simulator")
    assert match.config.task.opponent.command == ("python", "my bot/run.py")


def test_a_swiss_round_pairs_neighbours_who_have_not_met() -> None:
    ratings = {"a": 1300.0, "b": 1200.0, "c": 1000.0, "d": 900.0}
    pairs = [("a", "b"), ("a", "c"), ("a", "d"), ("b", "c"), ("b", "d"), ("c", "d")]
    assert pair_swiss(pairs, {}, ratings, ratings) == [("a", "b"), ("c", "d")]
    met = {frozenset("ab"): 2, frozenset("cd"): 2}
    assert pair_swiss(pairs, met, ratings, ratings) == [("b", "c"), ("a", "d")]
    levels = [("a", "easy"), ("b", "easy"), ("a", "hard"), ("b", "hard")]
    strong = {"a": 1300.0, "b": 900.0, "easy": 950.0, "hard": 1400.0}
    assert pair_swiss(levels, {}, strong, ["a", "b"]) == [("b", "easy"), ("a", "hard")]


# --- played ------------------------------------------------------------------------------------------


@pytest.fixture
def engine(monkeypatch: pytest.MonkeyPatch) -> MadeEngine:
    made = MadeEngine()
    monkeypatch.setattr(commands, "engine_of", lambda _options, _store: made)
    return made


def play(tmp_path: Path, **fields: Any) -> dict[str, Any]:
    file = tmp_path / "a.yaml"
    file.write_text(yaml.safe_dump(arena(**fields).model_dump(mode="json", exclude_defaults=True)))
    with pytest.raises(SystemExit) as ended:
        main(["arena", "run", str(file), "--out", str(tmp_path / "arenas")])
    assert not ended.value.code
    found: dict[str, Any] = json.loads((tmp_path / "arenas" / "a" / RESULTS).read_text())
    return found


@pytest.mark.parametrize("pairing", ["round-robin", "swiss"])
def test_every_match_is_played_once_and_more_rounds_play_only_what_is_new(
    pairing: str, tmp_path: Path, engine: MadeEngine
) -> None:
    first = play(tmp_path, pairing=pairing)
    number = len(engine.jobs)
    assert len(first["games"]) == number == (24 if pairing == "round-robin" else 16)
    again = play(tmp_path, pairing=pairing)
    assert (again, len(engine.jobs)) == (first, number)
    longer = play(tmp_path, pairing=pairing, rounds=3)
    assert len(longer["games"]) == len(engine.jobs) == number * 3 // 2


def test_matches_that_are_not_valid_are_counted_apart(tmp_path: Path, engine: MadeEngine) -> None:
    def ends(job: Job, _: int) -> str:
        return "invalid" if job.config.labels["factor.task"] == "2s3z" else "done"

    engine.ends = ends
    file = tmp_path / "a.yaml"
    file.write_text(yaml.safe_dump(arena().model_dump(mode="json", exclude_defaults=True)))
    with pytest.raises(SystemExit) as ended:
        main(["arena", "run", str(file), "--out", str(tmp_path)])
    assert ended.value.code == 3
    pool = pool_results([tmp_path / "a"])
    assert pool.remarks[0] == "6 matches of a crashed or are not valid: not counted."
    board = rate(pool)
    assert "map-2s3z" not in {line.player for line in board.players if line.ratings}
    assert board.remarks[-1] == "No valid games connect map-2s3z with an anchor: no rating."


def test_a_game_that_was_cut_at_its_limit_of_steps_is_a_draw_and_games_name_the_variant(
    tmp_path: Path, engine: MadeEngine
) -> None:
    engine.ends = lambda _job, _try: "cut"
    games = play(tmp_path, groups={"battles": ["pvz_task3_level1"]}, rounds=1, fixed={"variant": "paper"})["games"]
    assert {(found["outcome"], found["cause"], found["variant"]) for found in games} == {
        ("draw", "step limit", "paper")
    }


# --- ratings -----------------------------------------------------------------------------------------


def test_games_of_deterministic_players_that_end_alike_with_each_seed_count_once() -> None:
    alike = [game("a", "b", "win", seed=seed, steps=9) for seed in (1, 2, 3)]
    unlike = [game("b", "a", "win", seed=seed) for seed in (1, 2, 3)]
    assert distinct_games([*alike, *unlike]) == [alike[0], *unlike]


BATTLES = {"group": "battles", "task": "2s3z"}


def played(first: str, second: str, wins: int, losses: int, **fields: Any) -> list[ArenaGame]:
    """Return games of two players, with a seed each."""
    outcomes = ["win"] * wins + ["loss"] * losses
    return [game(first, second, outcome, seed=seed, **fields) for seed, outcome in enumerate(outcomes)]


def board_of(tmp_path: Path, *games: ArenaGame, **fields: Any) -> Leaderboard:
    write_results(results(*games, **fields), tmp_path / RESULTS)
    return rate(pool_results([tmp_path]))


def test_a_rating_of_a_group_says_what_its_games_cost_and_how_they_were_played(tmp_path: Path) -> None:
    games = [game("a", "b", "loss", seed=seed, of_second={"tokens": 300, "cost_usd": 0.5}) for seed in range(6)]
    games += [game("a", "b", "win", seed=seed, variant="paper", clock="token", **BATTLES) for seed in range(6)]
    board = board_of(tmp_path, *games)
    assert [line.player for line in board.standings("duels")] == ["b", "a"]
    assert [line.player for line in board.standings("battles")] == ["a", "b"]
    anchor, other = board.players
    assert (anchor.is_anchor, anchor.ratings["duels"].is_fixed, anchor.ratings["duels"].value) == (True, True, 1000.0)
    duels, battles = (other.ratings[group] for group in ("duels", "battles"))
    assert duels.value > 1000 > battles.value
    assert (duels.won, duels.lost, duels.cost_usd, duels.tokens) == (6, 0, 0.5, 300)
    assert (duels.clocks, duels.variants) == (("frozen",), ("files",))
    assert (battles.clocks, battles.variants, battles.cost_usd) == (("token",), ("paper",), None)


def test_overall_is_the_mean_over_groups_of_players_who_are_rated_in_all_of_them(tmp_path: Path) -> None:
    duels = [*played("a", "b", 2, 6), *played("a", "c", 4, 4)]
    battles = [*played("a", "b", 5, 2, **BATTLES), *played("a", "map-2s3z", 3, 3, **BATTLES)]
    board = board_of(tmp_path, *duels, *battles)
    assert board.columns == ("overall", "duels", "battles")
    assert [line.player for line in board.standings("overall")] == ["b", "a"]
    overall, *groups = (
        next(line for line in board.players if line.player == "b").ratings[name] for name in board.columns
    )
    assert overall.value == pytest.approx(sum(rating.value for rating in groups) / 2)
    below, above = ([getattr(rating, bound) - rating.value for rating in groups] for bound in ("low", "high"))
    assert overall.low == pytest.approx(overall.value - math.hypot(*below) / 2)
    assert overall.high == pytest.approx(overall.value + math.hypot(*above) / 2)
    assert (overall.won, overall.lost) == (6 + 2, 2 + 5)


@pytest.mark.slow
def test_nineteen_of_twenty_intervals_of_means_contain_the_true_mean(tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    strengths = {"a": (0.0, 0.0, 0.0), "b": (0.5, 2.0, -1.0), "c": (1.0, 4.0, 0.0)}  # c wins nearly all of a group
    held = []
    for _ in range(100):
        games = []
        for number, (first, second) in itertools.product(range(3), itertools.combinations(strengths, 2)):
            chance = 1 / (1 + math.exp(strengths[second][number] - strengths[first][number]))
            wins = int(rng.binomial(8, chance))
            games += played(first, second, wins, 8 - wins, group=str(number), task=str(number))
        for line in board_of(tmp_path, *games).standings("overall"):
            truth = 1000 + ELO * sum(strengths[line.player]) / 3
            held += [] if line.is_anchor else [line.ratings["overall"].low <= truth <= line.ratings["overall"].high]
    assert 0.92 <= sum(held) / len(held) <= 0.99


def test_a_player_who_beats_a_level_is_not_rated_below_it_because_it_lost_elsewhere(tmp_path: Path) -> None:
    """With one strength over all games, the level was rated above the player who had won all games against it."""
    duels = [*played("a", "strong", 8, 0), *played("a", "weak", 0, 0)]
    full = {"group": "full games", "task": "simple64_eceb"}
    games = [*played("strong", "level", 3, 0, **full), *played("a", "level", 0, 3, **full)]
    board = board_of(tmp_path, *duels, *games)
    assert [line.player for line in board.standings("full games")] == ["strong", "level", "a"]
    assert [line.player for line in board.standings("overall")] == ["strong", "a"]


@pytest.mark.parametrize(
    ("games", "columns", "remark"),
    [
        (played("a", "b", 3, 2), ("duels",), None),
        ([*played("a", "b", 3, 2), *played("a", "c", 3, 2, **BATTLES)], ("duels", "battles"), "There is no overall"),
        ([*played("a", "b", 3, 2), *played("x", "y", 3, 2, **BATTLES)], ("duels", "battles"), "No anchor has played"),
    ],
)
def test_there_is_no_overall_rating_where_it_compares_nobody(
    games: list[ArenaGame], columns: tuple[str, ...], remark: str | None, tmp_path: Path
) -> None:
    board = board_of(tmp_path, *games)
    assert board.columns == columns
    remarks = remarks_of(board, ())
    assert any(remark in line for line in remarks) if remark else not any("overall" in line for line in remarks)


@pytest.mark.parametrize(("field", "value"), [("clock", "token"), ("variant", "paper")])
def test_games_of_several_clocks_or_variants_in_a_group_are_remarked_on_and_are_no_repeats(
    field: str, value: str, tmp_path: Path
) -> None:
    alike = {"killed": 1.0, "steps": 9}
    games = [game("a", "b", "win", seed=1, **alike), game("a", "b", "win", seed=2, **alike, **{field: value})]
    assert distinct_games(games) == games
    (remark,) = board_of(tmp_path, *games).remarks
    assert f"The games of duels have several {field}s, " in remark


def test_a_group_whose_tasks_differ_more_than_one_rating_can_say_is_remarked_on(tmp_path: Path) -> None:
    """a wins everything on one task, and b on the other: as strong as each other, says the rating of the group."""
    games = [*played("a", "b", 9, 0), *played("a", "b", 0, 9, task="duel_8m")]
    (remark,) = board_of(tmp_path, *games).remarks
    assert (
        "The tasks of duels differ more than one rating for all of them can say: on duel_3m, a has 9 points" in remark
    )
    even = [*played("a", "b", 5, 4), *played("a", "b", 4, 5, task="duel_8m")]
    assert board_of(tmp_path, *even).remarks == ()


def test_groups_of_other_tasks_under_the_same_name_are_remarked_on(tmp_path: Path) -> None:
    write_results(results(*played("a", "b", 3, 2)), tmp_path / "x.json")
    write_results(results(*played("a", "c", 3, 2, task="duel_8m"), arena="other"), tmp_path / "y.json")
    (remark,) = pool_results([tmp_path / "x.json", tmp_path / "y.json"]).remarks
    assert remark.startswith("other has other tasks in duels than a file before")


def test_the_anchors_of_two_arenas_make_their_ratings_comparable(tmp_path: Path) -> None:
    for name, rival in (("one", "b"), ("two", "c")):
        (tmp_path / name).mkdir()
        games = [game("a", rival, "loss" if seed % 3 else "win", seed=seed) for seed in range(9)]
        write_results(results(*games, arena=name), tmp_path / name / RESULTS)
    alone = [rate(pool_results([tmp_path / name])).standings("duels")[0].ratings["duels"] for name in ("one", "two")]
    both = {
        line.player: line.ratings["duels"] for line in rate(pool_results([tmp_path / "one", tmp_path / "two"])).players
    }
    assert alone[0].value == pytest.approx(alone[1].value)
    assert both["b"].value == pytest.approx(alone[0].value, abs=1)
    assert both["c"].value == pytest.approx(alone[1].value, abs=1)


def test_a_match_that_two_files_have_counts_once(tmp_path: Path) -> None:
    games = [game("a", "b", "win", seed=seed) for seed in range(3)]
    for name in ("x.json", "y.json"):
        write_results(results(*games), tmp_path / name)
    assert len(pool_results([tmp_path / "x.json", tmp_path / "y.json"]).games) == 3


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"players": {n: PoolPlayer(kind="model", about=n, identity="1" * 16) for n in "ab"}}, "a is another player"),
        ({"anchors": {"a": 1100.0}}, "the anchor a has 1100 here and 1000 in a file before"),
        ({"players": {}}, "has the player 'a', whom `players` does not have"),
    ],
)
def test_files_that_do_not_fit_together_are_refused(changes: dict[str, Any], complaint: str, tmp_path: Path) -> None:
    write_results(results(game("a", "b", "win")), tmp_path / "x.json")
    write_results(results(game("a", "b", "win", seed=2), **changes), tmp_path / "y.json")
    with pytest.raises(ConfigError, match=complaint):
        pool_results([tmp_path / "x.json", tmp_path / "y.json"])


def test_a_file_of_anyone_names_no_path_outside_of_its_directory(tmp_path: Path) -> None:
    write_results(results(game("a", "b", "win")), tmp_path / "x.json")
    text = (tmp_path / "x.json").read_text()
    (tmp_path / "x.json").write_text(text.replace("matches/", "../matches/"))
    with pytest.raises(ConfigError, match=r"x\.json.*games\.0\.recording"):
        pool_results([tmp_path / "x.json"])


# --- the site ----------------------------------------------------------------------------------------


def test_every_rating_of_the_site_lists_its_games_and_names_cannot_break_out(tmp_path: Path) -> None:
    evil = "<script>alert(1)</script>"
    write_results(results(game("a", evil, "win"), game(evil, "a", "draw")), tmp_path / RESULTS)
    with pytest.raises(SystemExit) as ended:
        main(["arena", "export", str(tmp_path), "--into", str(tmp_path / "site")])
    assert not ended.value.code
    index = (tmp_path / "site" / "index.html").read_text()
    assert "<script" not in index and "&lt;script&gt;alert(1)" in index
    links = {link.partition('"')[0] for link in index.split('href="')[1:]}
    assert len(links) == 2
    for link in links:
        cell = (tmp_path / "site" / link).read_text()
        assert cell.count("<tr>") == 1 + 2 and "<script" not in cell
