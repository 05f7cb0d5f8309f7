"""Names for the game's numbers: unit types, buffs, upgrades, orders, abilities, as in PySC2.

Names only; `khala_bridge.knowledge` says what a unit can do. A number that PySC2 does not know (the game is newer)
gets a name made of the number, never an error.
"""

from __future__ import annotations

import functools
import re

from khala_bridge.compat import actions, buffs, features, units, upgrades

_UNITS: dict[int, str] = {
    int(member): member.name for race in (units.Neutral, units.Protoss, units.Terran, units.Zerg) for member in race
}
_COPIES = ("Colossus", "Stalker", "Zealot", "Marauder", "Marine", "Medivac", "Baneling", "Zergling", "Hydralisk")
_UNITS |= dict(enumerate(_COPIES, start=1962))  # on SMAC's maps, in the simulator's numbers; PySC2's end there
_BUFFS: dict[int, str] = {int(member): member.name for member in buffs.Buffs}
_UPGRADES: dict[int, str] = {int(member): member.name for member in upgrades.Upgrades}
_EFFECTS: dict[int, str] = {int(effect): effect.name for effect in features.Effects}
_FORM = re.compile(r"_(pt|unit|quick|autocast)$")  # how a raw function takes its target


def unit_name(unit_type: int) -> str:
    """Return the name of a unit type without its race, `Stalker`."""
    return _UNITS.get(unit_type) or f"Unit{unit_type}"


def buff_name(buff: int) -> str:
    """Return the name of a buff, `GravitonBeam`."""
    return _BUFFS.get(buff) or f"Buff{buff}"


def upgrade_name(upgrade: int) -> str:
    """Return the name of an upgrade, `Blink`."""
    return _UPGRADES.get(upgrade) or f"Upgrade{upgrade}"


def effect_name(effect: int) -> str:
    """Return the name of an effect on the ground, `PsiStorm`."""
    return _EFFECTS.get(effect) or f"Effect{effect}"


@functools.cache
def order_name(ability: int) -> str:
    """Return the name of an order, `Attack`, in its general form if there is one."""
    function = actions.RAW_ABILITY_ID_TO_FUNC_ID.get(ability)
    if function is None:
        return f"Ability{ability}"
    raw = actions.RAW_FUNCTIONS[function]
    if raw.general_id:
        return order_name(raw.general_id)
    return _FORM.sub("", raw.name)
