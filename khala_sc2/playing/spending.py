"""What the models of a match have cost: in its ledger, which stands beside its recording, or else in the recording.

A recording knows only what arrived at the host. The ledger knows what was sent: see `khala_agents.llm.money`.
"""

from __future__ import annotations

import os
from collections import defaultdict
from typing import TYPE_CHECKING

from khala_agents.llm.money import SUFFIX, MoneyLedger
from khala_orchestrator.roster import Seat
from khala_protocol.files import write_private
from khala_protocol.messages import ModelCall, Report
from khala_protocol.recording import Recording

if TYPE_CHECKING:
    from pathlib import Path

    from khala_orchestrator.past.resume import Unfinished
    from khala_protocol.messages import Usage


MOST_CHARACTERS = 4096
POINTER = "the ledger of this match is "
"""Begins the file that stands in the place of a ledger, and names it."""


def ledger_of(record: Path, past: Unfinished | None = None) -> MoneyLedger:
    """Return the ledger of a match that is recorded at a path; each side has an account in it.

    A match that goes on has the ledger of the recording that it goes on from, also if that is done twice.

    Raises:
        ConfigError: the file cannot be read.
    """
    if past is None or (past.config.forked is not None and past.config.forked.step == past.steps):
        ledger = MoneyLedger(_place_of(record))
    else:
        ledger = MoneyLedger(_place_of(past.recording.path))
        if not ledger.exists:
            for seat, usd in spent_usd(past.recording).items():
                ledger.pay(seat.side, usd)
        if ledger.exists:
            assert ledger.path is not None
            target = os.path.relpath(ledger.path, record.parent)
            write_private(record.with_suffix(SUFFIX), f"{POINTER}{target}\n")
    ledger.booked_usd()  # a broken one is found before the match begins
    return ledger


def _place_of(record: Path) -> Path:
    """Return where the ledger of a recording is: beside it, or where the file there points."""
    path = record.with_suffix(SUFFIX)
    try:
        with path.open(encoding="utf-8") as file:
            line = file.readline(MOST_CHARACTERS)
    except (OSError, UnicodeDecodeError):
        return path
    return path.parent / line.removeprefix(POINTER).strip() if line.startswith(POINTER) else path


def paid_usd(record: Path) -> float:
    """Return the most that a recorded match has cost, with what it cost before it was resumed.

    Raises:
        RecordingError: it has no ledger, and there is no recording.
    """
    ledger = MoneyLedger(_place_of(record))
    if not ledger.exists:
        return sum(spent_usd(Recording.open(record)).values())
    with ledger:
        return ledger.booked_usd()


def spent_usd(recording: Recording) -> dict[Seat, float]:
    """Return what each agent has paid at most for its model, as a recording has it; in a fork, since it was forked.

    A call whose answer came too late is in no report, and one that the recording left out is in no exchange: the larger
    of the two sums counts.
    """
    first = recording.run.forked.step if recording.run and recording.run.forked else 0
    calls, reports = defaultdict[Seat, float](float), defaultdict[Seat, float](float)
    for call in recording.of(ModelCall):
        if call.step >= first:
            calls[Seat(call.side, call.agent)] += _most_usd(call.usage)
    for report in recording.of(Report):
        for agent in report.agents:
            if (report.step if agent.asked_step is None else agent.asked_step) >= first:
                reports[Seat(agent.side, agent.agent)] += _most_usd(agent.usage)
    return {seat: max(calls[seat], reports[seat]) for seat in {**calls, **reports}}


def _most_usd(usage: Usage) -> float:
    return (usage.cost_usd or 0.0) + (usage.unknown_usd or 0.0)
