"""How another player is asked in: what is said to people, where its words go, and that it is no longer waited for."""

from __future__ import annotations

import sys
import threading
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


def _print(text: str) -> None:
    print(text, file=sys.stderr, flush=True)  # noqa: T201  # one line to copy, which a console would break


@dataclass(frozen=True, slots=True)
class Invitation:
    """The outside of a game that waits for another player."""

    log: Path | None = None
    """What the bot's process writes; None to drop it."""
    say: Callable[[str], None] = _print
    withdrawn: threading.Event = field(default_factory=threading.Event)
    """Set from another thread, it ends the wait."""
