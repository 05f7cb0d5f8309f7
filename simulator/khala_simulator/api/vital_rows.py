"""The rows of a table of vitals, by what they say of a unit; `vitals` fills the table."""

from __future__ import annotations

from typing import Final

ROWS: Final = 8
X: Final = 0
"""World units from the west."""
Y: Final = 1
"""World units from the south."""
LIFE: Final = 2
LIFE_MAX: Final = 3
SHIELDS: Final = 4
SHIELDS_MAX: Final = 5
ENERGY: Final = 6
COOLDOWN: Final = 7
"""Game loops until its weapon can fire again; 0 without one."""
