"""What a model sees: whether pictures are sent to it at all, how finely, and about how many tokens one takes.

Providers bill a picture by its size, each by a rule of its own. `TokenRule` holds the rules that are in use; a profile
has the one of its provider, a model file may say another. The count is an estimate: it keeps shared limits honest and
stands beside what the provider itself reports.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

from pydantic import Field

from khala_protocol.messages import Frozen

if TYPE_CHECKING:
    from khala_protocol.messages import ImageRef

Detail = Literal["auto", "low", "high"]


class TokenRule(Frozen):
    """How many tokens a picture takes.

    `area`: its pixels / `pixels`, once its longer side is at most `longest_px` (Anthropic). `tiles`: `base`, and `each`
    for every tile of `pixels` x `pixels`, once it fits into 2048 x 2048 and its shorter side is at most 768 (OpenAI's
    models before those of patches). `patches`: one for every patch of `pixels` x `pixels`, at most `most`, times `each`
    (OpenAI's small models; Qwen's with 28 pixels). `fixed`: `base`, whatever its size.
    """

    kind: Literal["area", "tiles", "patches", "fixed"]
    base: int = Field(default=0, ge=0)
    each: float = Field(default=1.0, gt=0)
    pixels: int = Field(default=1, ge=1)
    longest_px: int | None = Field(default=None, ge=1)
    most: int | None = Field(default=None, ge=1)
    """Patches, or tokens of `area`, that a picture is made smaller for; None for any number."""

    def tokens(self, width: int, height: int, detail: Detail = "auto") -> int:
        """Tokens of a picture of this size in pixels."""
        match self.kind:
            case "fixed":
                return self.base
            case "area":
                return self._of_area(width, height)
            case "patches":
                count = math.ceil(width / self.pixels) * math.ceil(height / self.pixels)
                return math.ceil(min(count, self.most or count) * self.each)
            case "tiles":
                return self.base if detail == "low" else self._of_tiles(width, height)

    def _of_area(self, width: int, height: int) -> int:
        shrink = min(1.0, (self.longest_px or math.inf) / max(width, height))
        tokens = math.ceil(width * shrink * height * shrink / self.pixels)
        return min(tokens, self.most or tokens)

    def _of_tiles(self, width: int, height: int) -> int:
        fit = min(1.0, 2048 / max(width, height))
        fit *= min(1.0, 768 / (min(width, height) * fit))
        # whole pixels: rounding must not make one more tile of a side that fits exactly
        across, down = (math.ceil(round(side * fit) / self.pixels) for side in (width, height))
        return self.base + math.ceil(self.each) * across * down


ANTHROPIC = TokenRule(kind="area", pixels=750, longest_px=1568, most=1600)
OPENAI = TokenRule(kind="tiles", base=85, each=170, pixels=512)
OPENAI_REASONING = TokenRule(kind="tiles", base=75, each=150, pixels=512)
QWEN = TokenRule(kind="patches", pixels=28, most=16384)
"""Many open models that see are Qwen's or cut pictures as Qwen's do."""


class Vision(Frozen):
    """What a model file says of a model that sees."""

    detail: Detail = "auto"
    """How finely the model looks, where the provider lets one choose (OpenAI)."""
    tokens: TokenRule | None = None
    """How pictures are counted; None for the rule of the profile."""
    max_images: int = Field(default=20, ge=1)
    """Pictures in one request; more are left out, the last ones first."""

    def counted_by(self, rule: TokenRule) -> Vision:
        """The same with a rule, if it has none."""
        return self if self.tokens else self.model_copy(update={"tokens": rule})

    def image_tokens(self, image: ImageRef) -> int:
        """About how many tokens a picture takes."""
        return self.tokens.tokens(image.width, image.height, self.detail) if self.tokens else 0
