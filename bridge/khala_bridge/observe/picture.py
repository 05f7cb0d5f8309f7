"""A finished picture: the bytes of a file, with its name and title."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from khala_protocol.messages import ImageRef

MediaType: TypeAlias = Literal["image/jpeg", "image/png", "image/webp"]


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture as it goes over the bus: bytes, with its name and title."""

    name: str
    title: str
    media_type: MediaType
    data: bytes
    width: int
    height: int
    sha256: str

    @property
    def ref(self) -> ImageRef:
        """Its reference in an observation."""
        return ImageRef(
            name=self.name,
            media_type=self.media_type,
            sha256=self.sha256,
            title=self.title,
            width=self.width,
            height=self.height,
            bytes=len(self.data),
        )
