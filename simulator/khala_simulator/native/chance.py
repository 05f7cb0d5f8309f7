"""Draws from a world's random generator, for interpreted rules; `chance.pyx` has the same for compiled ones."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from numpy.random import Generator


def draw(rng: Generator) -> float:
    """Return the generator's next number, from 0 to below 1."""
    return rng.random()
