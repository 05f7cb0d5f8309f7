"""A finished picture: bytes of a file, and what is to be said of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from khala_protocol.messages import ImageRef

MediaType: TypeAlias = Literal["image/jpeg", "image/png", "image/webp"]


@dataclass(frozen=True, slots=True)
class Picture:
    """What goes over the bus: bytes, and what is to be said of them."""

    name: str
    title: str
    media_type: MediaType
    data: bytes
    width: int
    height: int
    sha256: str

    @property
    def ref(self) -> ImageRef:
        """How an observation names it."""
        return ImageRef(
            name=self.name,
            media_type=self.media_type,
            sha256=self.sha256,
            title=self.title,
            width=self.width,
            height=self.height,
            bytes=len(self.data),
        )
