"""The exit codes of all commands; docs/how-to/faults.md says what each means."""

from __future__ import annotations

import signal

DONE = 0
FAILED = 1
"""Something that the user can fix, as `khala_protocol.commandline` ends a command, or what was asked about is bad."""
WRONG_USAGE = 2
"""Typer ends a command so."""
NOT_VALID = 3
"""A match was played, with an episode that says nothing about its agents."""
SIGNALLED = 128
"""Added to a signal's number it is the exit code, as shells expect it."""
AFTER_SIGNAL = tuple(SIGNALLED + number for number in (signal.SIGINT, signal.SIGTERM))
