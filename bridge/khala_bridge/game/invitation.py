"""How another player is asked in: what is said to people, where its words go, and that it is no longer waited for."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from khala_protocol.commandline import say

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


def _print(text: str) -> None:
    say(text, err=True)  # one line to copy, which a console would break


@dataclass(frozen=True, slots=True)
class Invitation:
    """The outside of a game that waits for another player."""

    log: Path | None = None
    """What the bot's process writes; None to drop it."""
    say: Callable[[str], None] = _print
    withdrawn: threading.Event = field(default_factory=threading.Event)
    """Set from another thread, it ends the wait."""
