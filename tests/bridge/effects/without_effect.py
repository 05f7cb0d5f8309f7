"""Text actions that cannot be seen to do anything on the simulator, and why.

The tests check that this is exact: one that begins to work has to leave the table. An action stands for the form of
it that names a single unit, too.
"""

from __future__ import annotations

IN_THE_MAKING = "only what is still in the making has it, and that belongs to no team yet"
SPRAY = "paints the ground, which changes nothing in the game; the simulator has no paint"
SHOOTERS_CHOOSE = (
    "told a point and no unit, those in a Bunker choose for themselves whom to shoot at, as they did before"
)
NEEDS_NO_POINT = "PySC2 offers a function of the screen only for what must have a point, and an add-on need not"
SINGLE = "Select_Unit_"

BY_RAW: dict[str, str] = {
    "Rally_Morphing_Unit_Screen": IN_THE_MAKING,
    "Rally_Morphing_Unit_Unit": IN_THE_MAKING,
    "Rally_Morphing_Unit_Minimap": IN_THE_MAKING,
    "Attack_Redirect_Screen": SHOOTERS_CHOOSE,
    "Effect_Spray_Screen": SPRAY,
    "Effect_Spray_Minimap": SPRAY,
    "Effect_Spray_Protoss_Screen": SPRAY,
    "Effect_Spray_Protoss_Minimap": SPRAY,
    "Effect_Spray_Terran_Screen": SPRAY,
    "Effect_Spray_Terran_Minimap": SPRAY,
    "Effect_Spray_Zerg_Screen": SPRAY,
    "Effect_Spray_Zerg_Minimap": SPRAY,
}
"""Through the raw interface."""
BY_SCREEN: dict[str, str] = BY_RAW | dict.fromkeys(
    (
        f"Build_{addon}{at}_Screen"
        for addon in ("TechLab", "Reactor")
        for at in ("", "_Barracks", "_Factory", "_Starport")
    ),
    NEEDS_NO_POINT,
)
"""Through camera, selection and screen."""


def reason(name: str, table: dict[str, str]) -> str | None:
    """Return why an action has no effect; None if it is to have one."""
    return table.get(name) or table.get(name.removeprefix(SINGLE))
