"""The report of an experiment: its numbers, its warnings, and that no name in it is markup."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from typing import TYPE_CHECKING, Any

import pytest
from typer.testing import CliRunner

from khala_protocol.errors import ConfigError
from khala_sc2.cli import app
from khala_sc2.experiment.plan import plan
from khala_sc2.experiment.report import FORMATS, report, write
from khala_sc2.experiment.report.calls import calls
from khala_sc2.experiment.report.document import ReportDocument, ReportSection, ReportTable
from tests.khala.experiment.handmade import CARD, HandMade
from tests.khala.experiment.made import record

if TYPE_CHECKING:
    from pathlib import Path

EARLY, LATE = set(range(1, 16)), set(range(9, 21))
HOSTILE = "[1]* <script>alert('&')</script> | $x^2$ _a_ \\end{document} % {\x1b]0;x\x07 `b` 中\u202e"


@pytest.fixture
def made(tmp_path: Path) -> HandMade:
    made = HandMade(tmp_path / "made")
    made.fill({"skilled": EARLY, "focus": LATE})
    return made


def table(made: HandMade, title: str, **given: Any) -> ReportTable:
    tables = (table for section in report(made.store, **given).document.sections for table in section.tables)
    found = {table.title: table for table in tables}
    return found[title]


def row(table: ReportTable, *where: str) -> dict[str, str]:
    texts = next(row for row in table.rows if row[: len(where)] == where)
    return dict(zip(table.columns, texts, strict=True))


def test_a_cell_has_its_games_with_intervals(made: HandMade) -> None:
    made.add({"task": "2s3z", "player": "focus"}, 21, "draw")
    skilled, focus = (row(table(made, "By cell"), "2s3z", player) for player in ("skilled", "focus"))
    assert (skilled["games"], skilled["won"]) == ("20", "75 % (53\N{EN DASH}89)")
    assert (focus["games"], focus["draws"], focus["length"]) == ("21", "1", "0:20")
    assert re.fullmatch(r"\d\.\d\d \(\d\.\d\d\N{EN DASH}\d\.\d\d\)", skilled["K/D"])


def test_kd_is_the_ratio_of_sums(made: HandMade) -> None:
    for seed, lost in ((1, 0.0), (2, 400.0)):
        made.add({"task": "3s5z", "player": "skilled"}, seed, killed_value=600.0, lost_value=lost)
    assert row(table(made, "By cell"), "3s5z", "skilled")["K/D"].startswith("3.00")


def test_the_overview_has_columns_for_the_values_of_the_last_factor(made: HandMade) -> None:
    found = table(made, "Overview")
    assert found.columns == ("task", "skilled: won", "skilled: K/D", "focus: won", "focus: K/D")
    assert len(found.rows) == 1


def test_by_pools_the_other_factors(made: HandMade) -> None:
    made.fill({"skilled": set()}, task="3s5z")
    assert row(table(made, "By cell", by=["player"]), "skilled")["games"] == "40"
    with pytest.raises(ConfigError, match="there is no factor 'players': there are task, player"):
        report(made.store, ["players"])


def test_what_agents_did_is_counted_per_game_and_per_hundred_calls(made: HandMade) -> None:
    values: dict[str, Any] = {
        "calls": 50,
        "fact_conflicting": 3,
        "accepted": 40,
        "rejected": 5,
        "decisions": 4,
        "fresh": 3,
        "stale": 1,
    }
    for seed in (1, 2):
        made.add({"task": "3s5z", "player": "skilled"}, seed, **values)
    actions = row(table(made, "Actions"), "3s5z", "skilled")
    assert (actions["accepted"], actions["refused"], actions["fact-conflicting"]) == ("40", "5", "6.0")
    decisions = row(table(made, "Decisions"), "3s5z", "skilled")
    assert (decisions["fresh"], decisions["stale"]) == ("75.0 %", "25.0 %")


def test_a_win_costs_what_all_games_cost(made: HandMade) -> None:
    money: dict[str, Any] = {"prompt_tokens": 900, "completion_tokens": 100, "cost_usd": 0.4, "paid_usd": 0.5}
    for seed, outcome in enumerate(("win", "loss", "loss", "win")):
        made.add({"task": "3s5z", "player": "skilled"}, seed, outcome, **money)
    found = row(table(made, "Tokens and money"), "3s5z", "skilled")
    assert (found["tokens a game"], found["USD a game"], found["USD a win"]) == ("1,000", "0.50", "1.00")


def test_economy_stands_there_only_if_there_is_any(made: HandMade) -> None:
    with pytest.raises(KeyError):
        table(made, "Economy")
    made.add({"task": "full", "player": "skilled"}, 1, supply_blocked_s=30.0, expansion_s=125.0)
    made.add({"task": "full", "player": "skilled"}, 2, supply_blocked_s=10.0)
    found = row(table(made, "Economy"), "full", "skilled")
    assert (found["supply blocked"], found["first expansion"]) == ("20.00 s", "2:05 (1 of 2)")
    assert "vespene unspent" not in found


def test_matches_that_do_not_count_are_counted_by_cause(made: HandMade) -> None:
    made.add({"task": "2s3z", "player": "focus"}, 3, state="invalid", cause="model away")
    made.add({"task": "2s3z", "player": "focus"}, 4, state="crashed", cause="timeout")
    focus = row(table(made, "By cell"), "2s3z", "focus")
    assert (focus["games"], focus["not counted"]) == ("18", "2")
    causes = row(table(made, "Not counted"), "2s3z", "focus")
    assert (causes["invalid: model away"], causes["crashed: timeout"]) == ("1", "1")


def test_the_sides_of_duels_have_lines_of_their_own(tmp_path: Path) -> None:
    duels = HandMade(tmp_path / "duels")
    for seed in range(1, 6):
        duels.duel({"task": "duel_3m"}, seed, winner="blue")
    found = table(duels, "By cell")
    assert row(found, "duel_3m", "blue")["won"].startswith("100 %")
    assert row(found, "duel_3m", "red")["won"].startswith("0 %")


def test_how_it_was_played_stands_there(made: HandMade) -> None:
    facts = {row[0]: row[1] for row in table(made, "").rows}
    assert facts["game"] == "Khala simulator 0.1.0, as 4.10.0.75689"
    assert facts["maps"] == "2s3z (00000000)"
    assert facts["clock"] == "frozen: 22 loops a step, waits at most 15 s"
    assert facts["rhythm"] == "paper; measured 22.4 game loops (1 s) and \N{EN DASH} s of wall a step"
    assert (facts["code"], facts["seeds"], facts["human advice"]) == ("c" * 12, "1 to 20", "none")


def test_models_are_named_as_they_were_asked_and_as_they_answered(made: HandMade) -> None:
    match = plan(made.store.experiment())[0]
    path = made.store.recording_for(match.key)
    record(path, match.config)
    made.store.take(path, attempts=1)
    facts = {row[0]: row[1] for row in table(made, "").rows}
    assert (facts["models as asked"], facts["models as answered"], facts["endpoints"]) == ("m", "m", "e")


@pytest.mark.parametrize(
    ("card", "words"),
    [
        ({"code": "d" * 64}, "code is mixed, cccccccccccc or dddddddddddd"),
        (
            {"clock": CARD["clock"] | {"max_wait_s": 30.0}},
            "2s3z, focus: clock.max_wait_s is mixed, 15.0 or 30.0",
        ),
    ],
)
def test_what_is_mixed_is_a_warning(made: HandMade, card: dict[str, Any], words: str) -> None:
    assert not report(made.store).document.warnings
    made.add({"task": "2s3z", "player": "focus"}, 1, card=card)
    assert words in report(made.store).document.warnings


def test_what_a_factor_sets_is_no_warning(made: HandMade) -> None:
    made.fill({"skilled": EARLY}, task="3s5z", card={"map": "3s5z " + "1" * 64, "opponent": "nobody"})
    assert not any("mixed" in warning for warning in report(made.store).document.warnings)


def test_what_was_not_played_yet_is_a_warning(made: HandMade) -> None:
    made.describe(seeds=25)
    assert report(made.store).document.warnings == ("10 of 50 matches were not played yet",)


def test_an_experiment_without_a_match_has_no_report(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no match of made was played"):
        report(HandMade(tmp_path / "empty").store)


# --- formats ------------------------------------------------------------------------------------------


class Page(HTMLParser):
    """Collects the tags of a page, and checks that they are closed in order."""

    VOID = ("meta",)

    def __init__(self) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.links: list[str] = []
        self.ids: list[str] = []
        self._open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.ids += [value or "" for name, value in attrs if name == "id"]
        self.links += [value or "" for name, value in attrs if name in {"src", "href", "xlink:href"}]
        if tag not in self.VOID:
            self._open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        self._open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag


@pytest.fixture
def hostile(made: HandMade) -> ReportDocument:
    made.add({"task": HOSTILE, "player": "skilled"}, 1, card={"game": HOSTILE})
    made.add({"task": HOSTILE, "player": "focus"}, 2, state="crashed", cause=HOSTILE)
    return report(made.store).document


def test_html_is_one_page_that_loads_nothing(hostile: ReportDocument) -> None:
    text = FORMATS["html"].text(hostile)
    page = Page()
    page.feed(text)
    page.close()
    assert "script" not in page.tags
    assert len(page.ids) == len(set(page.ids))
    assert all(link.startswith("#") for link in page.links)
    assert not re.search(r"url\((?!#)|@import", text)
    assert text.count("<svg") == 2
    assert "&lt;script&gt;alert(" in text
    assert "\x1b" not in text
    assert "\u202e" not in text


def test_latex_is_balanced_and_escaped(hostile: ReportDocument) -> None:
    text = FORMATS["latex"].text(hostile)
    bare = re.sub(r"\\[\\{}$&#_%]", "", text)
    assert bare.count("{") == bare.count("}")
    assert bare.count("$") % 2 == 0
    assert not set(bare) & set("#~^|%")
    begun, ended = (re.findall(rf"\\{word}{{(\w+)}}", text) for word in ("begin", "end"))
    assert sorted(begun) == sorted(ended)
    assert text.count(r"\end{document}") == 1
    assert r"\textless{}script\textgreater{}" in text
    assert r"\texttt{U+4E2D}" in text
    assert not re.search(r"\\\\\s*[\[*]", text)
    assert all(ord(letter) < 0x180 for letter in text)
    rows = [line for line in text.splitlines() if line.endswith(r" \\") and "2s3z &" in line]
    assert rows


def test_markdown_has_rows_of_as_many_cells_as_columns(hostile: ReportDocument) -> None:
    text = FORMATS["markdown"].text(hostile)
    tables = [part for part in text.split("\n\n") if part.startswith("|")]
    widths = [{len(re.findall(r"(?<!\\)\|", line)) for line in table.splitlines()} for table in tables]
    assert len(widths) > 3
    assert all(len(found) == 1 for found in widths)
    assert "\\<script\\>" in text


def test_documents_are_plain_until_a_format_writes_them() -> None:
    document = ReportDocument(
        "a_b", (), ("50 % & more",), (ReportSection("c", tables=(ReportTable("t", ("x",), (("<1",),), 1),)),)
    )
    texts = [writer.text(document) for writer in FORMATS.values()]
    escaped = (("a\\_b", "50 % \\& more", "\\<1"), (r"a\_b", r"50 \% \& more", r"\textless{}1"),
               ("a_b", "50 % &amp; more", "&lt;1"))  # fmt: skip
    for text, words in zip(texts, escaped, strict=True):
        assert all(word in text for word in words)


def test_pictures_stand_beside_markdown_and_latex_and_are_the_same_each_time(made: HandMade, tmp_path: Path) -> None:
    document = report(made.store).document
    files = write(document, tmp_path / "out", list(FORMATS))
    assert [path.name for path in files] == [
        "report.md", "report.tex", "report.html", "win_rate.png", "kd.png", "win_rate.pdf", "kd.pdf",
    ]  # fmt: skip
    assert (tmp_path / "out" / "kd.png").read_bytes().startswith(b"\x89PNG")
    assert FORMATS["html"].text(document) == FORMATS["html"].text(report(made.store).document)


def test_the_command_writes_the_formats_and_prints_numbers(made: HandMade, tmp_path: Path) -> None:
    made.add({"task": "3s5z", "player": "skilled"}, 1, lost_value=0.0)
    command = ["experiment", "report", str(made.store.directory), "--format", "html", "--into", str(tmp_path / "r")]
    printed = CliRunner().invoke(app, [*command, "--json"])
    data = json.loads(printed.stdout)
    assert data["files"] == [str(tmp_path / "r" / "report.html")]
    cell = next(one for one in data["cells"] if one["where"] == {"task": "2s3z", "player": "skilled"})
    assert (cell["games"], cell["won"]["value"]) == (20, 0.75)
    assert "were not played yet" not in printed.stdout.partition('"warnings"')[0]


def test_calls_are_counted_by_agent_and_action_where_they_count() -> None:
    def row(match: str, agent: str, action: str, became: str, count: int) -> dict[str, Any]:
        return {"match": match, "side": "blue", "agent": agent, "action": action, "became": became, "count": count}

    rows = [
        row("a", "Stalkers", "Attack_Unit", "accepted", 6), row("b", "Stalkers", "Attack_Unit", "dead_target", 2),
        row("b", "Zealots", "Stop", "accepted", 1), row("crashed", "Zealots", "Stop", "accepted", 99),
    ]  # fmt: skip
    table = calls(rows, {"a", "b"})
    assert table is not None
    assert table.rows == (
        ("Stalkers", "Attack_Unit", "8", "75.0 %", "dead target 2"),
        ("Zealots", "Stop", "1", "100.0 %", ""),
    )
    assert calls(rows, set()) is None
