"""Titles of pictures, one line each: the frame, the colours, the letters and marks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from khala_bridge.observe.image.features import SHOWN
from khala_bridge.observe.image.palette import LIVERIES

if TYPE_CHECKING:
    from khala_bridge.observe.image.layers import FeatureLayer
    from khala_bridge.observe.image.palette import Side
    from khala_bridge.observe.image.screen import Legend

_ON_SCREEN: dict[Side, str] = {
    "team": "this team",
    "own": "your side's other units",
    "ally": "allied players",
    "enemy": "enemies",
    "neutral": "nobody's",
}
_ON_MINIMAP = {**_ON_SCREEN, "team": "your units"}


def of_screen(team: str, extent: float, legend: Legend) -> str:
    """Return the title of a team's screen."""
    parts = [
        f"Screen of team {team}, from [0, 0] at the top left to {_corner(extent)}",
        "rendered by the game" if legend.rendered else "",
        ("marks: " if legend.rendered and legend.sides else "") + _colours(legend, _ON_SCREEN),
    ]
    if legend.codes:
        parts.append("letters: " + ", ".join(f"{code} {name}" for code, name in legend.codes.items()))
    if legend.example:
        mark, tag = legend.example
        parts.append(f"a mark at a unit is the part of its tag before the last four digits, {mark} is {hex(tag)}")
    if legend.unmarked:
        parts.append(f"{legend.unmarked} unit{'s have' if legend.unmarked > 1 else ' has'} no mark for want of room")
    return "; ".join(part for part in parts if part) + "."


def of_minimap(extent: float, legend: Legend) -> str:
    """Return the title of the minimap."""
    parts = [
        f"Minimap, from [0, 0] at the top left to {_corner(extent)}",
        "rendered by the game" if legend.rendered else "",
        _colours(legend, _ON_MINIMAP),
        "" if legend.rendered else "squares are structures and resources",
        "crosses are teams, white frames what yours see, yellow rings where your side was hurt",
    ]
    return "; ".join(part for part in parts if part) + "."


def of_layer(team: str, extent: float, layer: FeatureLayer) -> str:
    """Return the title of a feature layer of a team's screen."""
    return f"Layer {layer.name} of the screen of team {team}, to {_corner(extent)}: {layer.about}."


def of_minimap_layer(extent: float, layer: FeatureLayer) -> str:
    """Return the title of a feature layer of the minimap."""
    return f"Layer {layer.name} of the minimap, to {_corner(extent)}: {layer.about}."


def of_features(team: str) -> str:
    """Return the title of the picture of nine layers."""
    rows = "; ".join(", ".join(SHOWN[start : start + 3]) for start in range(0, len(SHOWN), 3))
    return f"Feature layers of the screen of team {team}, row by row: {rows}."


def _colours(legend: Legend, words: dict[Side, str]) -> str:
    return ", ".join(f"{LIVERIES[side].name}: {words[side]}" for side in legend.sides if side != "neutral")


def _corner(extent: float) -> str:
    return f"[{extent:g}, {extent:g}]"
