"""What a person sees of a match: a live line per agent while it runs, and a table at the end.

It gets the same messages that go over the bus, and prints to stderr, so that stdout stays free for JSON. The consoles
here are the only ones: whatever is printed on them, no character of it does anything to the terminal.
"""

from __future__ import annotations

import math
import os
import time
from collections import Counter
from typing import TYPE_CHECKING, Any, Self, TypeVar, cast

from rich import box
from rich.console import Console, Group
from rich.live import Live
from rich.panel import Panel
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from khala_orchestrator.roster import Seat
from khala_protocol.messages import LOOPS_PER_S, Frozen, Report, Result, Run, Usage, Wire, count_refusals
from khala_protocol.visible import visible, visible_line

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from pathlib import Path
    from types import TracebackType

    from rich.console import ConsoleOptions, RenderableType

    from khala_protocol.messages import AgentReport, AgentStatus, Clock

OUTCOME = {"win": "bold green", "draw": "bold yellow", "cut": "bold yellow", "loss": "bold red", "aborted": "bold red"}
WIDEST = 10_000
"""Characters of a row in a pipe; no table has as many."""
HEARTBEAT_S = 30.0
"""Off a terminal, a line is printed after so many seconds, with the next report."""
SIDE = {"blue": "bold blue", "red": "bold red"}
"""Sides of other names are all of one colour."""

M = TypeVar("M", bound=Frozen)


class _VisibleConsole(Console):
    """A console for foreign words: `[red]` in them is no markup, and an escape sequence is shown instead of obeyed."""

    def __init__(self, *, stderr: bool = False) -> None:
        super().__init__(stderr=stderr, highlight=False, markup=False, emoji=False)

    def render_str(self, text: str, **how: Any) -> Text:
        """Return a text, of which every character counts when a table measures its columns."""
        return super().render_str(visible(text), **how)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yield the segments of anything that is printed, texts with a style of their own among them."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(visible(segment.text), segment.style)


def stderr_console() -> Console:
    """Return a console on stderr, where a person reads."""
    return _VisibleConsole(stderr=True)


def stdout_console() -> Console:
    """Return a console on stdout."""
    return _VisibleConsole()


def print_table(table: Table) -> None:
    """Print a table that fits its contents on stdout; in a pipe or a file, a row is one line, whatever its length."""
    console = stdout_console()
    if not (console.is_terminal or "COLUMNS" in os.environ):
        console.width = WIDEST
    console.print(table)


class Progress:
    """Shows a match while it runs. A context manager; call it with each message of the host.

    On a terminal it is a live picture; elsewhere, such as in a log, a line for the first step and every `HEARTBEAT_S`.
    """

    def __init__(
        self,
        screen: Console,
        max_steps: int | None = None,
        logs: Path | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Take a screen, the steps of an episode, the directory of the agents' logs, and a clock in seconds."""
        self._clock = clock
        self._said_at = -math.inf  # the first report is a line as well
        self._screen = screen
        self._logs = logs
        self._failures: set[str] = set()
        """Causes that were shown."""
        self._max_steps = max_steps
        self._run: Run | None = None
        self._reports: dict[str, Report] = {}
        """By side, its newest one."""
        self._counts: dict[Seat, Counter[str]] = {}
        self._usage: dict[Seat, Usage] = {}
        self._live = Live(console=screen, refresh_per_second=8, transient=True)

    def __enter__(self) -> Self:
        if self._screen.is_terminal:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.stop()

    def __call__(self, message: Wire) -> None:
        """Show a run card, a report or a result."""
        message = visible_message(message)
        match message:
            case Run():
                self._run = message
                self._screen.print(card(message))
            case Report():
                self._add(message)
            case Result():
                self._screen.print(table(message, named=two_sides(self._run)))
        if self._screen.is_terminal and self._reports:
            self._live.update(self._picture())
        elif isinstance(message, Report) and self._clock() - self._said_at >= HEARTBEAT_S:
            self._said_at = self._clock()
            self._screen.print(self._heartbeat(message), soft_wrap=True)

    def _heartbeat(self, report: Report) -> str:
        """Return where the match is, on one line."""
        steps = f" of {self._max_steps}" if self._max_steps else ""
        counts = sum(self._counts.values(), Counter())
        orders = f"{counts['accepted']} orders carried out, {counts['rejected']} refused"
        own = f"{counts['ok']} decisions" + (f" ({others} not the agents' own)" if (others := _others(counts)) else "")
        episode = f"episode {report.episode}, " if report.episode else ""
        return (
            f"{episode}step {report.step}{steps}, game {clock(report.game_loop)}: {own}, {orders}; tokens: "
            + _tokens(self._usage.values())
        )

    def _add(self, report: Report) -> None:
        self._reports[report.side] = report
        for agent in report.agents:
            seat = Seat(agent.side, agent.agent)
            counts = self._counts.setdefault(seat, Counter())
            counts[agent.status] += 1
            counts["accepted"] += len(agent.accepted)
            counts["rejected"] += count_refusals(agent.rejections).total()
            self._show_failure(agent, report.step)
            self._usage[seat] = self._usage.get(seat, Usage()) + agent.usage

    def _show_failure(self, agent: AgentReport, step: int) -> None:
        """Print why an agent did not decide when it happens for the first time."""
        cause = f"{agent.status} {agent.detail}"
        if agent.status == "ok" or cause in self._failures:
            return
        self._failures.add(cause)
        why = agent.reason or agent.detail or agent.status
        what = "another policy decided for it" if agent.status == "fallback" else "it did not decide"
        log = f"; its log is in {self._logs}" if self._logs else ""
        line = f"step {step}: {agent.agent}: {agent.status}, {what}: {why}{log}"
        self._screen.print(Text(visible_line(line), "yellow"), soft_wrap=True)

    def _picture(self) -> Panel:
        rows = Table(box=None, expand=True, pad_edge=False)
        for name in ("agent", "status", "latency", "accepted", "rejected", "tokens"):
            rows.add_column(name, no_wrap=True)
        rows.add_column("last action", style="dim", no_wrap=True, overflow="ellipsis", ratio=1)
        for agent in (agent for report in self._reports.values() for agent in report.agents):
            rows.add_row(*self._row(agent))
        newest = max(self._reports.values(), key=lambda report: (report.episode, report.step))
        steps = f" of {self._max_steps}" if self._max_steps else ""
        line = Text(f"step {newest.step}{steps}   game {clock(newest.game_loop)}   score ")
        line.append_text(Text(", ").join(self._score(report) for report in self._reports.values()))
        title = f"{self._run.played_task} · {self._run.run}" if self._run else ""
        return Panel(Group(line, rows), title=Text(title), border_style="blue")

    def _score(self, report: Report) -> Text:
        score = f"{report.score:g}"
        return Text.assemble(side(report.side), f" {score}") if two_sides(self._run) else Text(score)

    def _row(self, agent: AgentReport) -> tuple[str | Text, ...]:
        seat = Seat(agent.side, agent.agent)
        counts, usage = self._counts[seat], self._usage[seat]
        return (
            speaker(seat, named=two_sides(self._run)),
            Text(agent.status, style_of(agent.status)),
            "" if agent.latency_s is None else f"{agent.latency_s:.2f} s",
            str(counts["accepted"]),
            str(counts["rejected"]),
            f"{usage.prompt_tokens + usage.completion_tokens:,}",
            Text(visible_line(agent.accepted[-1] if agent.accepted else agent.detail), overflow="ellipsis"),
        )


def style_of(status: AgentStatus) -> str:
    """Return the colour of a status: red where nobody decided."""
    return {"ok": "green", "fallback": "yellow"}.get(status, "red")


def two_sides(run: Run | None) -> bool:
    """Return whether agents play against agents, so that what a side did needs its name."""
    return run is not None and len({agent.side for agent in run.agents}) > 1


def side(name: str) -> Text:
    """Return the name of a side in its colour."""
    return Text(name, SIDE.get(name, "bold magenta"))


def speaker(seat: Seat, *, named: bool) -> Text:
    """Return the name of an agent, after that of its side if `named`."""
    return Text.assemble(side(seat.side), "/", seat.agent) if named else Text(seat.agent)


def card(run: Run) -> Panel:
    """Return a panel with the run card."""
    rows = Table.grid(padding=(0, 2))
    rows.add_row("task", f"{run.played_task} on {run.map_name}, seed {run.seed}, {run.episodes} episode(s)")
    rows.add_row("game", f"{run.game}, {run.executor} executor")
    if run.opponent:
        rows.add_row("against", run.opponent)
    rows.add_row("clock", rule(run.clock))
    if run.rethink:
        rows.add_row("rethink", ", ".join(f"{name} {count} a step" for name, count in run.rethink.items()))
    sides: dict[str, list[str]] = {}
    for agent in run.agents:
        who = f"{agent.name}, human" if agent.human else agent.name
        sides.setdefault(agent.side, []).append(f"{who} ({', '.join(agent.teams)})")
    for name, agents in sides.items():
        rows.add_row(side(name) if two_sides(run) else "agents", ", ".join(agents))
    seeing = {", ".join(agent.pictures): None for agent in run.agents if agent.pictures}
    if seeing:
        rows.add_row("pictures", f"{'; '.join(seeing)}: they show more than the texts say")
    return Panel(rows, title=Text(run.run), border_style="dim", box=box.ROUNDED)


def rule(clock: Clock) -> str:
    """Return what a clock says of a match, on one line."""
    wait = "as long as it takes" if clock.max_wait_s is None else f"at most {clock.max_wait_s:g} s"
    price = {
        "frozen": "",
        "budget": f"{clock.thinking_loops} for a decision, ",
        "token": "more for more tokens, ",
        "realtime": f"{LOOPS_PER_S * clock.speed:g} in a second, ",
    }
    return f"{clock.rule}: {clock.step_loops} loops a step, {price[clock.rule]}waits {wait}"


def table(result: Result, *, named: bool = False) -> Panel:
    """Return a panel with the result of an episode; `named` if there is one of another side, too."""
    rows = Table.grid(padding=(0, 2))
    if result.variant == "paper":
        rows.add_row("variant", "paper: as the paper says, where its published files do something else")
    kd = "none lost" if result.kd is None else f"{result.kd:.2f}"
    rows.add_row(
        "K/D",
        f"{kd}  (killed {_losses(result.killed.units, result.killed.value)}, "
        f"lost {_losses(result.lost.units, result.lost.value)})",
    )
    if held := result.holdings:
        counts = f"{held.workers} worker(s), {held.bases} base(s), army of {held.army}"
        rows.add_row("held", f"{counts}, supply {held.supply_used} of {held.supply_cap}")
    took = f"{clock(result.game_loop)} of game in {result.wall_s:.1f} s, {result.env_steps} calls of SC2Env.step"
    rows.add_row("steps", f"{result.steps}, {took}")
    if result.latency_p50_s is not None and result.latency_p95_s is not None:
        milliseconds = f"median {result.latency_p50_s * 1000:.0f} ms, 95 % below {result.latency_p95_s * 1000:.0f} ms"
        rows.add_row("latency", milliseconds)
    rejected = ", ".join(f"{count} {reason}" for reason, count in sorted(result.rejections.items())) or "none"
    rows.add_row("actions", f"{result.accepted} accepted; rejected: {rejected}")
    if result.hallucinations:
        kinds = sorted(result.hallucinations.items())
        rows.add_row("hallucinations", ", ".join(f"{count} {kind.replace('_', '-')}" for kind, count in kinds))
    rows.add_row("tokens", _tokens(result.usage.values()))
    if result.advisers:
        rows.add_row("advice", ", ".join(f"{count} by {name}" for name, count in result.advisers.items()))
    if fates := sum(map(Counter, result.fates.values()), Counter()):
        rows.add_row("decisions", _decisions(result, fates))
    for incident in result.incidents:
        rows.add_row("incident", Text(incident, "yellow"))
    if not result.valid:
        rows.add_row("not valid", Text(result.invalid_because, "bold red"))
    for agent in sorted(result.statuses.keys() | result.unasked.keys()):
        rows.add_row(agent, _steps_of(result, agent))
    whose = Text.assemble(side(result.side), ": ") if named else Text()
    outcome, *cause = result.ending.partition(",")
    title = Text.assemble(whose, (outcome, OUTCOME[result.outcome]), *cause, f" (episode {result.episode})")
    return Panel(rows, title=title, border_style=OUTCOME[result.outcome].removeprefix("bold "), box=box.ROUNDED)


UNASKED = {"no_units": "not asked, without units", "not_due": "not asked, not due"}


def _steps_of(result: Result, agent: str) -> str:
    """Return how an agent's steps ended: `177 ok, 23 not asked, without units`."""
    counts = sorted(result.statuses.get(agent, {}).items())
    counts += [("by a human", result.humans[agent])] if agent in result.humans else []
    counts += [("asked to rethink", count)] if (count := result.rethinks.get(agent)) else []
    counts += [(UNASKED[why], count) for why, count in sorted(result.unasked.get(agent, {}).items())]
    return ", ".join(f"{count} {words}" for words, count in counts)


def visible_message(message: M) -> M:
    """Return a message in which all text is visible."""
    return cast("M", _visible(message))


def _visible(value: Any) -> Any:
    match value:
        case str():
            return visible(value)
        case Frozen():
            return value.having({name: _visible(field) for name, field in value})
        case dict():
            return {_visible(key): _visible(item) for key, item in value.items()}
        case tuple() | list():
            make = getattr(value, "_make", type(value))  # a named tuple takes its fields one by one
            return make(map(_visible, value))
    return value


def _tokens(usages: Iterable[Usage]) -> str:
    total = sum(usages, start=Usage())
    if total.shortened_requests:
        parts = ", ".join(f"{count} {part}" for part, count in total.left_out.items())
        return (
            f"{_sum_in_words(total)}; {total.shortened_requests} prompt(s) did not fit the context, left out: {parts}"
        )
    return _sum_in_words(total)


def _sum_in_words(total: Usage) -> str:
    text = f"{total.prompt_tokens:,} in"
    if total.images:
        text += f" (about {total.image_tokens:,} of them for {total.images} pictures)"
    text += f", {total.completion_tokens:,} out, {total.requests} request(s)"
    if total.unknown_requests:
        text += f", {total.unknown_requests} of unknown size"
    return text + (", no price known" if total.cost_usd is None else f", {total.cost_usd:.4f} USD")


def _others(counts: Counter[str]) -> int:
    """Return the number of decisions that agents did not make themselves."""
    return sum(count for status, count in counts.items() if status not in {"ok", "accepted", "rejected"})


def _decisions(result: Result, fates: Counter[str]) -> str:
    counts = ", ".join(f"{count} {fate}" for fate, count in fates.most_common())
    lag = f"; the game was {result.lag_s:.1f} s behind" if result.lag_s else ""
    if not result.age_p50_loops and not result.age_p95_loops:
        return counts + lag
    return f"{counts}; median age {result.age_p50_loops:g} loops, 95 % below {result.age_p95_loops:g}{lag}"


def _losses(units: int, value: float) -> str:
    return f"{units} unit(s) worth {value:g}"


def clock(game_loop: int) -> str:
    """Return minutes and seconds of the game."""
    seconds = int(game_loop / LOOPS_PER_S)
    return f"{seconds // 60}:{seconds % 60:02d}"
