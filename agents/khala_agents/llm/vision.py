"""What a model sees: whether pictures are sent to it, how finely it looks, and about how many tokens one costs.

Providers bill a picture by its size, each by its own rule. `TokenRule` holds the known rules; a profile names the
one of its provider, a model file may name another. The count is an estimate: it keeps shared limits honest, and
is recorded next to what the provider itself reports.
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
    """The number of tokens of a picture.

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
        """Return the tokens of a picture of this size in pixels."""
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
GEMINI = TokenRule(kind="fixed", base=1120)
"""The most that Gemini's models from 3 on spend on a picture as they look at it by default; those before spend 258."""
QWEN = TokenRule(kind="patches", pixels=28, most=16384)
"""Many open vision models are Qwen's, or cut pictures as Qwen's do."""


class Vision(Frozen):
    """The vision settings of a model file, for a model that sees."""

    detail: Detail = "auto"
    """How finely the model looks, where the provider offers a choice (OpenAI)."""
    tokens: TokenRule | None = None
    """How pictures are counted; None for the rule of the profile."""
    max_images: int = Field(default=20, ge=1)
    """Pictures in one request; of more, the last ones are left out."""

    def counted_by(self, rule: TokenRule) -> Vision:
        """Return the same settings with this rule, if they have none."""
        return self if self.tokens else self.model_copy(update={"tokens": rule})

    def image_tokens(self, image: ImageRef) -> int:
        """Return about how many tokens a picture costs."""
        return self.tokens.tokens(image.width, image.height, self.detail) if self.tokens else 0
