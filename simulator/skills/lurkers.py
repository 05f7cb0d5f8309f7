"""The burrowed Lurker's hold fire: it picks no target by itself until it is told to again."""

from __future__ import annotations

from typing import Final

from simulator.skills.basics import off_self, on_self
from simulator.skills.skill import Skill

SKILLS: Final = {
    "lurker_hold_fire": Skill(on_self("LurkerHoldFireB")),
    "lurker_remove_hold_fire": Skill(off_self("LurkerHoldFireB")),
}
