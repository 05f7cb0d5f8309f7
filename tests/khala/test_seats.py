"""A caller plays agents of a match: it sees what they see over the bus, and its replies have the same fates."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

import pytest

from khala_agents.scripted.players import PLAYERS
from khala_orchestrator.config import MatchConfig, change, load_task
from khala_protocol.errors import ConfigError
from khala_protocol.messages import Observation, Reply, Report
from khala_protocol.recording import Recording
from khala_sc2.playing import one_process
from khala_sc2.playing.minds import Minds
from khala_sc2.playing.seats import NotAsked, Seat, SeatedMatch, SeatsTurn, seats_of, without_time_limit

if TYPE_CHECKING:
    from pathlib import Path

game = pytest.mark.game
STALKERS, ZEALOTS = Seat("blue", "Stalkers"), Seat("blue", "Zealots")


def config(name: str = "2s3z_pair", *, episodes: int = 1, record: Path | None = None, **changes: object) -> MatchConfig:
    task = without_time_limit(change(load_task(name), **changes))
    return MatchConfig(task=task, run="seats", episodes=episodes, record=record)


def skilled(text: str) -> str:
    return PLAYERS["skilled"](text, random.Random(f"0 {text}"))


async def played(match: SeatedMatch) -> list[SeatsTurn]:
    """Play all seats of a match as the scripted player does."""
    turns: list[SeatsTurn] = []
    while not turns or not turns[-1].over:
        turns.append(turn := await match.turn())
        for seat, seen in turn.asked.items():
            match.act(seat, skilled(seen.observation.text))
    return turns


@pytest.mark.slow
@game
async def test_a_match_of_seats_is_the_match_over_the_bus(tmp_path: Path) -> None:
    here, there = tmp_path / "here.mcap", tmp_path / "there.mcap"
    of_seats = config(max_steps=6, record=here)
    async with SeatedMatch(of_seats, seats_of(of_seats.task)) as match:
        turns = await played(match)
    over_bus = config(max_steps=6, record=there)
    (result,) = await one_process.play(over_bus, {"blue": Minds().with_name("skilled")}, game="simulator")
    times = {"wall_s": 0, "latency_p50_s": 0, "latency_p95_s": 0, "lag_s": 0}
    assert [one.but(**times) for turn in turns for one in turn.results] == [result.but(**times)]
    first, second = Recording.open(here), Recording.open(there)
    assert list(first.of(Observation)) == list(second.of(Observation))
    assert [(one.agent, one.text) for one in first.of(Reply)] == [(one.agent, one.text) for one in second.of(Reply)]


@game
async def test_a_turn_asks_all_agents_of_the_caller_and_reports_what_became_of_their_replies() -> None:
    async with SeatedMatch(config(max_steps=2, episodes=2), [ZEALOTS, STALKERS]) as match:
        first = await match.turn()
        assert list(first.asked) == [STALKERS, ZEALOTS]
        assert first.asked[ZEALOTS].briefing.agent == "Zealots"
        assert first.reports == ()
        match.act(STALKERS, "Stalker-1: <Attack_Unit(0x1)>")
        rest = await match.turn()
        assert list(rest.asked) == [ZEALOTS]
        with pytest.raises(NotAsked, match=r"^blue/Stalkers waits for no answer, blue/Zealots does: `turn` says"):
            match.act(STALKERS, "")
        match.act(ZEALOTS, "Zealot-1: <Hold_Position()>")
        second = await match.turn()
        (report,) = second.reports
        assert [(one.agent, one.accepted, [why.reason for why in one.rejections]) for one in report.agents] == [
            ("Stalkers", (), ["unknown_target"]),
            ("Zealots", ("Zealot-1 <Hold_Position()>",), []),
        ]
        for seat in second.asked:
            match.act(seat, "")
        ended = await match.turn()
        assert ([one.step for one in ended.reports], ended.results[0].cause) == ([1], "step limit")
        assert (ended.asked, ended.over) == ({}, False)
        again = await match.turn()
        assert {seen.observation.episode for seen in again.asked.values()} == {1}
        assert again.reports == ()


@pytest.mark.slow
@game
async def test_others_play_on_while_the_caller_has_one_seat_of_a_side() -> None:
    asked = config("duel_3m", max_steps=3)
    async with SeatedMatch(asked, [Seat("red", "Captain")], {"blue": Minds().with_name("focus-fire")}) as match:
        turns = await played(match)
    assert [list(turn.asked) for turn in turns] == [[Seat("red", "Captain")]] * 3 + [[]]
    assert {report.side for turn in turns for report in turn.reports} == {"red"}
    assert [result.side for result in turns[-1].results] == ["red"]


@pytest.mark.slow
@game
async def test_news_are_each_agent_that_is_asked_or_no_longer_waited_for_and_each_step() -> None:
    hasty = change(load_task("2s3z_pair"), max_steps=1, max_wait_s=0.5)
    told: list[SeatsTurn] = []
    async with SeatedMatch(MatchConfig(task=hasty, run="seats"), [STALKERS, ZEALOTS]) as match:
        while not told or not told[-1].over:
            told.append(await match.news())
            if STALKERS in told[-1].asked:
                match.act(STALKERS, "")
    waiting = [tuple(turn.asked) for turn in told]
    assert any(STALKERS in seats for seats in waiting)
    assert any(ZEALOTS in seats for seats in waiting)
    assert waiting[-1] == ()
    (report,) = [report for turn in told for report in turn.reports]
    assert {one.agent: one.status == "ok" for one in report.agents} == {"Stalkers": True, "Zealots": False}
    assert len(told[-1].results) == 1


@game
async def test_pictures_of_an_observation_are_handed_out_with_it() -> None:
    async with SeatedMatch(config(max_steps=1, images="screen"), [STALKERS, ZEALOTS]) as match:
        seen = (await match.turn()).asked[STALKERS]
    assert [len(picture) for picture in seen.pictures] == [ref.bytes for ref in seen.observation.images]
    assert seen.pictures


@pytest.mark.slow
@game
async def test_a_game_that_dies_is_gone_on_with_at_the_open_turn(tmp_path: Path) -> None:
    asked = config(max_steps=3, record=tmp_path / "recording.mcap")
    async with SeatedMatch(asked, seats_of(asked.task)) as match:
        for _ in range(2):
            for seat in (await match.turn()).asked:
                match.act(seat, "")
        assert list((await match.turn()).asked) == [STALKERS, ZEALOTS]
        match.act(STALKERS, "")
        end_games()
        match.act(ZEALOTS, "")
        ended = await match.turn()
    assert ended.over
    assert (tmp_path / "recording.lost-1.mcap").exists()
    assert [report.step for report in Recording.open(asked.record or tmp_path).of(Report)] == [0, 1, 2]


def end_games() -> None:
    """Kill the games that this process has started."""
    import psutil

    for child in psutil.Process().children(recursive=True):
        if "khala_simulator" in " ".join(child.cmdline()):
            child.kill()


def test_seats_are_those_of_both_sides_in_the_order_of_the_match() -> None:
    assert seats_of(load_task("2s3z_pair")) == [STALKERS, ZEALOTS]
    assert seats_of(load_task("duel_3m")) == [Seat("blue", "Captain"), Seat("red", "Captain")]


def test_an_unhurried_task_has_no_limit_for_an_answer() -> None:
    task = without_time_limit(load_task("duel_3m"))
    assert [side.clock.max_wait_s for side in task.per_side()] == [None, None]


@pytest.mark.parametrize(
    ("seats", "says"),
    [
        ([Seat("blue", "Nobody")], "the task 2s3z_pair has no seat blue/Nobody: it has blue/Stalkers, blue/Zealots"),
        ([ZEALOTS], "nobody decides for blue/Stalkers: take its seat as well, or give minds for side blue"),
    ],
)
def test_seats_that_cannot_be_played_are_refused_before_anything_starts(seats: list[Seat], says: str) -> None:
    with pytest.raises(ConfigError, match=f"^{says}$"):
        SeatedMatch(config(), seats)
