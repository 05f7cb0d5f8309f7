"""Pictures in task files: their names and sizes, without any drawing.

`khala_bridge.observe.image` draws them.
"""

from __future__ import annotations

import difflib
from typing import Literal, TypeAlias

from pydantic import Field, field_validator, model_validator

from khala_protocol.messages import Frozen

ImageFormat: TypeAlias = Literal["jpeg", "png", "webp"]

DRAWN_LAYERS = (
    "height_map",
    "visibility_map",
    "creep",
    "power",
    "player_relative",
    "unit_type",
    "unit_hit_points_ratio",
    "unit_shields_ratio",
    "unit_energy_ratio",
    "unit_density",
    "build_progress",
    "effects",
    "pathable",
    "buildable",
)
"""Feature layers of the screen that can be drawn for any team, wherever the game's camera is."""
GAME_LAYERS = (
    "player_id",
    "selected",
    "unit_hit_points",
    "unit_energy",
    "unit_shields",
    "unit_density_aa",
    "hallucinations",
    "cloaked",
    "blip",
    "buffs",
    "buff_duration",
    "active",
    "placeholder",
)
"""Feature layers that only the game itself draws, where its own camera is."""
MINIMAP_LAYERS = (
    "height_map",
    "visibility_map",
    "creep",
    "camera",
    "player_id",
    "player_relative",
    "selected",
    "unit_type",
    "alerts",
    "pathable",
    "buildable",
)
"""Feature layers of the minimap; the game draws them at any time."""
WHOLE = ("screen", "minimap", "features")
KINDS = (*WHOLE, *(f"layer:{n}" for n in (*DRAWN_LAYERS, *GAME_LAYERS)), *(f"minimap:{n}" for n in MINIMAP_LAYERS))
"""Everything that `ImageSpec.what` may be."""
PAPER = {
    "combat_group": ("screen", "minimap"),
    "commander": ("minimap",),
    "developer": ("minimap",),
    "builder": ("screen", "minimap", "layer:power", "layer:pathable", "layer:buildable"),
}
"""Pictures that the paper shows to each kind of agent."""


class ImageSpec(Frozen):
    """One kind of picture in each observation of an agent."""

    what: str
    """`screen`: what a team sees, in colours; `minimap`: the whole map; `features`: nine feature layers of a team's
    screen in one picture; `layer:<name>`: one of them alone, such as `layer:buildable`; `minimap:<name>`: one of the
    minimap's."""
    size_px: int = Field(default=512, ge=128, le=2048)
    """Length of its sides, the labels of its axes included."""
    format: ImageFormat = "jpeg"
    quality: int = Field(default=85, ge=1, le=100)
    """Of JPEG and WebP."""
    marks: bool = True
    """Whether units on a screen carry three digits of their tags, and their types two letters."""
    grid: bool = True
    """Whether to draw grid lines."""
    source: Literal["drawn", "game", "auto"] | None = None
    """`drawn` from raw data, for any team at any time; `game`: the game's own pixels, and no picture if its camera
    is not at the team; `auto`: the game's own pixels if they are available, else drawn. By default all pictures that
    can be drawn are drawn."""
    max_teams: int = Field(default=3, ge=1)
    """Number of the agent's teams that get a picture, the first ones of its observation."""

    @field_validator("what")
    @classmethod
    def _known(cls, what: str) -> str:
        if what in KINDS:
            return what
        close = difflib.get_close_matches(what, KINDS, n=1)
        hint = f"did you mean '{close[0]}'?" if close else f"there are {', '.join(WHOLE)}, layer:<name>, minimap:<name>"
        raise ValueError(f"there is no picture '{what}', {hint}")

    @model_validator(mode="after")
    def _can_be_drawn(self) -> ImageSpec:
        if self.source == "drawn" and not self._is_drawable:
            raise ValueError(f"{self.what} comes from the game only: leave source out, or say source: game")
        return self

    @property
    def _is_drawable(self) -> bool:
        return self.what == "minimap" or (self.of_teams and self.layer not in GAME_LAYERS)

    @property
    def is_drawn(self) -> bool:
        """True if it may be drawn from raw data."""
        return self._is_drawable and self.source != "game"

    @property
    def is_taken(self) -> bool:
        """True if the game's own pixels are accepted, if they are available."""
        return self.source in {"game", "auto"} or not self._is_drawable

    @property
    def layer(self) -> str:
        """Name of the feature layer; empty for other pictures."""
        return self.what.partition(":")[2]

    @property
    def is_rendered(self) -> bool:
        """True if the game must render."""
        return self.is_taken and self.what in {"screen", "minimap"}

    @property
    def of_teams(self) -> bool:
        """True if it shows a team's screen, and not the whole map."""
        return not self.what.startswith("minimap")


def images_for(words: str, kind: str) -> tuple[ImageSpec, ...]:
    """Return the pictures of a short description.

    Args:
        words: `paper` for those of the agent's kind, `none`, or the content of each picture, separated by commas.
        kind: of the agent.

    Raises:
        ValidationError: there is no such picture.
    """
    if words == "none":
        return ()
    asked = PAPER[kind] if words == "paper" else words.split(",")
    return tuple(ImageSpec(what=what.strip()) for what in asked)
