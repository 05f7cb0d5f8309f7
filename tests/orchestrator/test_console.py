"""What a person sees of a match while it runs and at its end."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from rich.console import Console
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from khala_orchestrator.console import Progress, card, clock, print_table, rule, stderr_console, stdout_console, table
from khala_protocol.messages import AgentReport, Casualties, Clock, EndState, Rejection, Report, Result, Usage
from khala_protocol.visible import visible

if TYPE_CHECKING:
    from collections.abc import Callable

    from khala_protocol.messages import Run

    Printed = Callable[..., list[str]]
    MakeRun = Callable[..., Run]

RUN = "test"
FAULT = Rejection(reason="unknown_target", message="No.", text="<Attack_Unit(0x9)>", start=0)


def make_result(**changes: Any) -> Result:
    fields: dict[str, Any] = {
        "run": RUN,
        "episode": 0,
        "outcome": "win",
        "cause": "enemy defeated",
        "steps": 42,
        "env_steps": 45,
        "game_loop": 1500,
        "game_s": 66.9,
        "wall_s": 12.34,
        "killed": Casualties(units=3, value=450),
        "lost": Casualties(units=1, value=125),
        "kd": 3.6,
        "usage": {
            "Stalkers": Usage(requests=42, prompt_tokens=120_000, completion_tokens=4_000, cost_usd=0.25),
            "Zealots": Usage(requests=40, prompt_tokens=80_000, completion_tokens=1_000, cost_usd=0.125),
        },
        "statuses": {"Zealots": {"ok": 40, "late": 2}, "Stalkers": {"ok": 42}},
        "rejections": {"unknown_target": 2, "malformed": 1},
        "accepted": 99,
        "latency_p50_s": 0.8,
        "latency_p95_s": 2.5,
    }
    return Result.model_validate(fields | changes)


def agent(name: str, **changes: Any) -> AgentReport:
    return AgentReport.model_validate({"agent": name, "side": "blue", "status": "ok", "latency_s": 0.8} | changes)


def report(step: int, *agents: AgentReport) -> Report:
    return Report(run=RUN, episode=0, step=step, game_loop=224 * step, agents=agents, score=2.5 * step)


# --- failures ---------------------------------------------------------------------------------------------


def test_the_first_failure_of_each_kind_is_shown_at_once_with_the_log() -> None:
    out = io.StringIO()
    progress = Progress(Console(file=out, width=200), logs=Path("runs/first"))
    failed = agent("Stalkers", status="failed", detail="http 500", reason="the \x1b[31mendpoint is on fire")
    for step in range(1, 4):
        progress(report(step, failed, agent("Zealots", status="empty")))
    lines = [line for line in out.getvalue().splitlines() if "did not decide:" in line]
    assert lines == [
        "step 1: Stalkers: failed, it did not decide: the \\x1b[31mendpoint is on fire; its log is in runs/first",
        "step 1: Zealots: empty, it did not decide: empty; its log is in runs/first",
    ]


# --- panels -----------------------------------------------------------------------------------------------


def test_a_run_card(printed: Printed, card_of_run: Run) -> None:
    assert printed(card(card_of_run), width=80) == [
        "╭──────────────────────────────────── test ────────────────────────────────────╮",
        "│ task    2s3z_pair on 2s3z, seed 1, 1 episode(s)                              │",
        "│ game    Khala simulator 0.1.0, as 4.10.0.75689, raw executor                 │",
        "│ clock   frozen: 11 loops a step, waits at most 15 s                          │",
        "│ agents  Stalkers (Stalker-1), Zealots (Zealot-1, Zealot-2)                   │",
        "╰──────────────────────────────────────────────────────────────────────────────╯",
    ]


def test_a_run_card_and_a_result_name_the_variant_of_the_paper(printed: Printed, card_of_run: Run) -> None:
    lines = printed(card(card_of_run.model_copy(update={"variant": "paper"})), width=100)
    assert any("2s3z_pair (variant paper) on 2s3z" in line for line in lines)
    fields = {"run": "r", "episode": 0, "outcome": "win", "cause": "", "steps": 1, "game_loop": 1, "game_s": 1.0}
    found = Result(
        **fields, wall_s=1.0, killed=Casualties(), lost=Casualties(), kd=None, variant="paper",
        hallucinations={"fact_conflicting": 2, "context_conflicting": 1},
    )  # fmt: skip
    lines = printed(table(found), width=100)
    assert any("variant" in line and "paper: as the paper says" in line for line in lines)
    assert any("hallucinations  1 context-conflicting, 2 fact-conflicting" in line for line in lines)
    assert not any(
        "variant" in line for line in printed(table(found.model_copy(update={"variant": "files"})), width=100)
    )


def test_a_run_card_says_that_pictures_show_more_than_texts(printed: Printed, card_of_run: Run) -> None:
    first, *others = card_of_run.agents
    seeing = first.model_copy(update={"pictures": ("screen", "minimap")})
    lines = printed(card(card_of_run.model_copy(update={"agents": (seeing, *others)})), width=80)
    assert any("pictures  screen, minimap: they show more than the texts say" in line for line in lines)
    assert not any("pictures" in line for line in printed(card(card_of_run), width=80))


def test_a_run_card_without_a_deadline(printed: Printed, make_run: MakeRun) -> None:
    lines = printed(card(make_run(clock=Clock(max_wait_s=None))), width=80)
    assert lines[3] == "│ clock   frozen: 8 loops a step, waits as long as it takes                    │"


def test_a_result(printed: Printed) -> None:
    assert printed(table(make_result()), width=80) == [
        "╭────────────────────── win, enemy defeated (episode 0) ───────────────────────╮",
        "│ K/D       3.60  (killed 3 unit(s) worth 450, lost 1 unit(s) worth 125)       │",
        "│ steps     42, 1:06 of game in 12.3 s, 45 calls of SC2Env.step                │",
        "│ latency   median 800 ms, 95 % below 2500 ms                                  │",
        "│ actions   99 accepted; rejected: 1 malformed, 2 unknown_target               │",
        "│ tokens    200,000 in, 5,000 out, 82 request(s), 0.3750 USD                   │",
        "│ Stalkers  42 ok                                                              │",
        "│ Zealots   2 late, 40 ok                                                      │",
        "╰──────────────────────────────────────────────────────────────────────────────╯",
    ]


def test_the_result_of_a_game_with_bases_says_what_the_side_has_at_the_end(printed: Printed) -> None:
    held = EndState(workers=22, bases=2, army=15, supply_used=54, supply_cap=62)
    lines = printed(table(make_result(holdings=held)), width=80)
    held_line = next(line for line in lines if "held" in line)
    assert held_line.strip("│ ") == "held      22 worker(s), 2 base(s), army of 15, supply 54 of 62"


def test_what_is_not_known_of_a_result_is_said_or_left_out(printed: Printed) -> None:
    nothing = make_result(
        kd=None, lost=Casualties(), usage={}, rejections={}, accepted=0, latency_p50_s=None, latency_p95_s=None,
        outcome="draw", cause="step limit", episode=3, statuses={},
    )  # fmt: skip
    assert [line.strip("│ ") for line in printed(table(nothing), width=80)[1:-1]] == [
        "K/D      none lost  (killed 3 unit(s) worth 450, lost 0 unit(s) worth 0)",
        "steps    42, 1:06 of game in 12.3 s, 45 calls of SC2Env.step",
        "actions  0 accepted; rejected: none",
        "tokens   0 in, 0 out, 0 request(s), no price known",
    ]
    assert "cut at 42 steps (episode 3)" in printed(table(nothing))[0]


def test_pictures_and_requests_of_unknown_size_are_named_beside_the_tokens(printed: Printed) -> None:
    usage = Usage(requests=3, prompt_tokens=5000, completion_tokens=70, images=2, image_tokens=1600, unknown_requests=1)
    (line,) = [line for line in printed(table(make_result(usage={"A": usage})), width=140) if "tokens" in line]
    assert line.strip("│ ") == (
        "tokens    5,000 in (about 1,600 of them for 2 pictures), 70 out, 3 request(s), 1 of unknown size, "
        "no price known"
    )


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({"rule": "frozen", "max_wait_s": 15}, "frozen: 8 loops a step, waits at most 15 s"),
        ({"rule": "budget", "thinking_loops": 22}, "budget: 8 loops a step, 22 for a decision, waits at most 15 s"),
        ({"rule": "token"}, "token: 8 loops a step, more for more tokens, waits at most 15 s"),
        ({"rule": "realtime", "speed": 2}, "realtime: 8 loops a step, 44.8 in a second, waits at most 15 s"),
    ],
)
def test_a_clock_in_a_line(fields: dict[str, Any], line: str) -> None:
    assert rule(Clock.model_validate(fields)) == line


def test_a_result_says_what_became_of_decisions_and_what_went_wrong(printed: Printed) -> None:
    lines = printed(
        table(
            make_result(
                outcome="aborted", cause="agents gone", valid=False,
                invalid_because="required agents went away: blue/A",
                fates={"A": {"fresh": 3}, "B": {"stale": 2, "fresh": 1}}, age_p50_loops=8, age_p95_loops=40, lag_s=1.25,
                incidents=("step 7: required agent blue/A did not come back within 15 s",),
            )
        ),
        width=100,
    )  # fmt: skip
    assert "aborted, agents gone (episode 0)" in lines[0]
    assert [" ".join(line.strip("│ ").split()) for line in lines[6:9]] == [
        "decisions 4 fresh, 2 stale; median age 8 loops, 95 % below 40; the game was 1.2 s behind",
        "incident step 7: required agent blue/A did not come back within 15 s",
        "not valid required agents went away: blue/A",
    ]


def test_game_time_is_minutes_and_seconds(subtests: pytest.Subtests) -> None:
    for game_loop, shown in (
        (0, "0:00"),
        (22, "0:00"),
        (23, "0:01"),
        (224, "0:10"),
        (1344, "1:00"),
        (100_000, "74:24"),
    ):
        with subtests.test(game_loop=game_loop):
            assert clock(game_loop) == shown


# --- while it runs ----------------------------------------------------------------------------------------


def test_without_a_terminal_a_line_says_every_half_minute_where_the_match_is(make_run: MakeRun) -> None:
    screen = Console(file=io.StringIO(), width=200, force_terminal=False)
    now = [0.0]
    with Progress(screen, max_steps=50, clock=lambda: now[0]) as show:
        show(make_run())
        for step in range(42):
            now[0] += 4.0
            show(report(step, agent("Stalkers", usage=Usage(requests=1, prompt_tokens=1000, completion_tokens=10))))
        show(make_result())
    lines = screen.file.getvalue().splitlines()  # type: ignore[attr-defined]
    steps = [line for line in lines if line.startswith("step")]
    assert [line.partition(",")[0] for line in steps] == [f"step {n} of 50" for n in (0, 8, 16, 24, 32, 40)]
    assert "game 1:20: 9 decisions, " in steps[1]
    assert "tokens: 9,000 in, 90 out, 9 request(s), no price known" in steps[1]


def test_a_table_says_how_many_prompts_were_shortened_and_what_was_left_out() -> None:
    screen = Console(file=io.StringIO(), width=200, force_terminal=False)
    usage = Usage(requests=3, shortened_requests=2, left_out={"worked example": 2, "Map": 1})
    screen.print(table(make_result(usage={"A": usage})))
    said = screen.file.getvalue()  # type: ignore[attr-defined]
    assert "2 prompt(s) did not fit the context, left out: 2 worked example, 1 Map" in said


def test_on_a_terminal_every_agent_has_a_line(printed: Printed, make_run: MakeRun) -> None:
    screen = Console(file=io.StringIO(), width=100, force_terminal=True)
    usage = Usage(requests=1, prompt_tokens=1000, completion_tokens=234)
    with Progress(screen, max_steps=50) as show:
        show(make_run())
        show(report(0, agent("Stalkers", accepted=("Stalker-1 <Stop()>", "Stalker-1 <Hold()>"), usage=usage)))
        show(
            report(
                1,
                agent("Stalkers", usage=usage, rejections=(FAULT, FAULT)),
                agent("Zealots", status="late", latency_s=None, detail="no reply before the deadline"),
            )
        )
        picture = printed(show._live.renderable)
    assert picture == [
        "╭──────────────────────────────────────── 2s3z_pair · test ────────────────────────────────────────╮",
        "│ step 1 of 50   game 0:10   score 2.5                                                             │",
        "│ agent     status  latency  accepted  rejected  tokens  last action                               │",
        "│ Stalkers  ok      0.80 s   2         2         2,468                                             │",
        "│ Zealots   late             0         0         0       no reply before the deadline              │",
        "╰──────────────────────────────────────────────────────────────────────────────────────────────────╯",
    ]


def test_the_last_action_is_the_last_one_that_was_accepted(printed: Printed) -> None:
    screen = Console(file=io.StringIO(), width=100, force_terminal=True)
    with Progress(screen) as show:
        show(report(3, agent("Stalkers", accepted=("Stalker-1 <Stop()>", "Stalker-1 <Hold()>"))))
        lines = printed(show._live.renderable)
    assert lines[1].startswith("│ step 3   game 0:30   score 7.5 ")
    assert "Stalker-1 <Hold()>" in lines[3]
    assert "<Stop()>" not in lines[3]


def test_people_are_spoken_to_on_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    stderr_console().print("ready: 7")
    out, err = capsys.readouterr()
    assert (out, err) == ("", "ready: 7\n")


@pytest.fixture
def make_run(card: MakeRun) -> MakeRun:
    return card


@pytest.fixture
def card_of_run(card: MakeRun) -> Run:
    return card()


EVIL = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202e[red][link=http://e]"


@pytest.mark.parametrize("wrap", [lambda text: text, Text, lambda text: Text.assemble("a ", (text, "red")), Panel])
@pytest.mark.parametrize("make", [stdout_console, stderr_console])
def test_foreign_words_are_printed_and_not_obeyed(
    capsys: pytest.CaptureFixture[str], make: Callable[[], Console], wrap: Callable[[str], Any]
) -> None:
    """Whatever renders them."""
    rows = Table("heading", title=EVIL)
    rows.add_row(wrap(EVIL))
    console = make()
    console.width = 200
    for what in (wrap(EVIL), rows):
        console.print(what, style="bold")
    said = capsys.readouterr()
    text = said.out + said.err
    assert not [character for character in text if not (character.isprintable() or character == "\n")]
    assert text.count(r"\x1b]0;owned") == 3
    assert "[red][link=http://e]" in text


def test_a_column_is_as_wide_as_what_is_shown_of_foreign_words(capsys: pytest.CaptureFixture[str]) -> None:
    rows = Table("heading")
    rows.add_row(EVIL)
    console = stdout_console()
    console.width = 200
    console.print(rows)
    assert visible(EVIL) in capsys.readouterr().out


def test_a_row_is_one_line_in_a_pipe_and_fits_a_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = Table("name", "words", box=None)
    rows.add_row("x", "a word " * 40)
    monkeypatch.delenv("COLUMNS", raising=False)
    print_table(rows)
    assert len(capsys.readouterr().out.splitlines()) == 2
    monkeypatch.setenv("COLUMNS", "60")
    print_table(rows)
    assert all(len(line) <= 60 for line in capsys.readouterr().out.splitlines())
