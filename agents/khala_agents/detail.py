"""How much detail a model is shown: a limit of the tokens of whole prompts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal

if TYPE_CHECKING:
    from collections.abc import Mapping

Detail = Literal["full", "short", "tiny"]
DETAILS: Final[Mapping[Detail, int | None]] = {"full": None, "short": 2_000, "tiny": 1_000}
"""Estimated tokens at most; None for any number."""
