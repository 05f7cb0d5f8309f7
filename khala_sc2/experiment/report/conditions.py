"""How the matches of an experiment were played, and what differs that should be the same."""

from __future__ import annotations

import hashlib
import json
from statistics import median
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from khala_orchestrator.console import rule
from khala_protocol.errors import RecordingError
from khala_protocol.messages import LOOPS_PER_S, Clock, ModelCall
from khala_protocol.recording import Recording
from khala_sc2.experiment.likeness import differences
from khala_sc2.experiment.numbers import NONE, number
from khala_sc2.experiment.report.document import ReportTable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from khala_sc2.experiment.played import PlayedMatch
    from khala_sc2.experiment.report.summary import Cell
    from khala_sc2.experiment.selection import Row
    from khala_sc2.experiment.store import Store

EVERYWHERE = ("game", "actions", "code", "versions", "hardware")
"""Fields of run cards that are the same in all matches of an experiment."""
IN_A_CELL = ("map", "opponent", "executor", "clock", "task")
"""Fields that cells may set, so that they are the same within each."""
CALLS = 200
"""Requests of a recording that are looked at for the prompts of its agents."""
HASH = 12
"""Characters of a hash that are shown."""
NAMED = 4
"""Values that are named; of more, the number is given."""


def warnings(cells: Iterable[Cell], played: Sequence[PlayedMatch]) -> list[str]:
    """Return in what matches differ that should be alike."""
    done = [match for match in played if match.state == "done"]
    found = [str(difference) for difference in differences(done, done, EVERYWHERE)]
    by_key = {match.key: match for match in done}
    for cell in cells:
        matches = [by_key[row["match"]] for row in cell.rows]
        where = ", ".join(cell.where.values())
        found += [f"{where}: {difference}" for difference in differences(matches, matches, IN_A_CELL)]
    return list(dict.fromkeys(found))


def conditions(store: Store, played: Sequence[PlayedMatch], rows: Sequence[Row]) -> ReportTable:
    """Return how the matches that count were played; a field with several values has all of them."""
    done = [match for match in played if match.state == "done"]
    keys = {match.key for match in done}
    rows = [row for row in rows if row["match"] in keys]
    cards = [match.card for match in done]
    calls = _first_calls(store, done)
    facts = (
        ("game", _values(card.get("game") for card in cards)),
        ("maps", _values((card.get("map") for card in cards), _map)),
        ("opponents", _values(card.get("opponent") for card in cards)),
        ("clock", _values((card.get("clock") for card in cards), _clock)),
        ("rhythm", f"{_values((card.get('task') or {}).get('rhythm') for card in cards)}; {_measured_rhythm(rows)}"),
        ("executor", _values(card.get("executor") for card in cards)),
        ("models as asked", _values(call.model for call in calls)),
        ("models as answered", _values(name for row in rows for name in row["models"].split("; "))),
        ("endpoints", _values(_host(name) for row in rows for name in row["endpoints"].split("; "))),
        ("parameters", _values(name for row in rows for name in row["params"].split("; "))),
        ("prompts", _prompts(calls)),
        ("actions", _values((card.get("actions") for card in cards), _short)),
        ("tasks", _hashes(card.get("task") for card in cards)),
        ("code", _values((card.get("code") for card in cards), _short)),
        ("versions", _values((card.get("versions") for card in cards), _pairs)),
        ("hardware", _values((card.get("hardware") for card in cards), _pairs)),
        ("seeds", _seeds(done)),
        ("human advice", _count(rows, ("advice",))),
        ("decisions not the agents' own", _count(rows, ("undecided",))),
        ("because of", _values(cause for row in rows for cause in row["undecided_because"].split("; "))),
    )  # fmt: skip
    return ReportTable("", ("", ""), tuple(fact for fact in facts if fact[1]), words=2)


def _first_calls(store: Store, done: Iterable[PlayedMatch]) -> list[ModelCall]:
    """Return the first requests of one match of each cell: all others of a cell have the same prompts."""
    firsts = {tuple(match.cell.values()): match for match in reversed(list(done)) if match.recording}
    return [call for match in firsts.values() for call in _calls(store, match)]


def _calls(store: Store, match: PlayedMatch) -> list[ModelCall]:
    try:
        recording = Recording.open(store.directory / match.recording)
    except RecordingError:
        return []
    agents: dict[tuple[str, str], ModelCall] = {}
    for call, _ in zip(recording.of(ModelCall), range(CALLS), strict=False):
        agents.setdefault((call.side, call.agent), call)
    return list(agents.values())


def _prompts(calls: Iterable[ModelCall]) -> str:
    texts = sorted({str(part.content) for call in calls for part in call.prompt if part.role == "system"})
    return f"{len(texts)} system prompts, together {_sha256(texts)}" if texts else ""


def _hashes(values: Iterable[Any]) -> str:
    texts = sorted({json.dumps(value, sort_keys=True) for value in values if value})
    return f"{len(texts)} task files, together {_sha256(texts)}" if texts else ""


def _sha256(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()[:HASH]


def _values(values: Iterable[Any], words: Callable[[Any], str] = str) -> str:
    texts = list(dict.fromkeys(words(value) for value in values if value))
    if len(texts) > NAMED:
        return f"{', '.join(texts[:NAMED])} and {len(texts) - NAMED} more"
    return " or ".join(texts) if any("," in text for text in texts) else ", ".join(texts)


def _map(words: str) -> str:
    name, _, sha256 = words.rpartition(" ")
    return f"{name} ({sha256[:8]})"


def _clock(card: dict[str, Any]) -> str:
    return rule(Clock.model_validate(card))


def _short(sha256: str) -> str:
    return sha256[:HASH]


def _pairs(values: dict[str, Any]) -> str:
    return ", ".join(f"{name} {value}" for name, value in values.items())


def _host(url: str) -> str:
    """Return the address without a port, which is another one for each scripted endpoint."""
    return urlsplit(url).hostname or url


def _measured_rhythm(rows: Sequence[Row]) -> str:
    """Return how often agents were asked, as it was."""
    games = [row for row in rows if row["steps"] and row["game_s"]]
    if not games:
        return "not measured"
    step_s = median(row["game_s"] / row["steps"] for row in games)
    walls = [row["wall_s"] / row["steps"] for row in games if row["wall_s"] is not None]
    wall = number(median(walls)) if walls else NONE
    lag = max(row["lag_s"] or 0.0 for row in games)
    behind = f", at most {number(lag)} s behind" if lag else ""
    return (
        f"measured {number(step_s * LOOPS_PER_S)} game loops ({number(step_s)} s) and {wall} s of wall a step{behind}"
    )


def _seeds(done: Sequence[PlayedMatch]) -> str:
    seeds = sorted({match.seed for match in done})
    whole = len(seeds) > 2 and seeds == list(range(seeds[0], seeds[-1] + 1))
    return f"{seeds[0]} to {seeds[-1]}" if whole else _values(map(str, seeds))


def _count(rows: Sequence[Row], names: Sequence[str]) -> str:
    total = sum(row[name] for row in rows for name in names)
    return f"{total:,} in {sum(any(row[name] for name in names) for row in rows)} games" if total else "none"
