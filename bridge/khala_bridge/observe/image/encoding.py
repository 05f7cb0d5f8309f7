"""Turn an image into a picture: encode, hash and name it."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING

import cv2

from khala_bridge.observe.picture import Picture

if TYPE_CHECKING:
    from khala_bridge.observe.image.lettering import Image
    from khala_bridge.observe.picture import MediaType
    from khala_bridge.task.images import ImageFormat

MEDIA_TYPES: dict[ImageFormat, MediaType] = {"jpeg": "image/jpeg", "png": "image/png", "webp": "image/webp"}
_PNG_EFFORT = 1
"""Of 9: files with these flat colours grow by a tenth, and encoding takes a third of the time."""


def encode(image: Image, name: str, title: str, format_: ImageFormat = "jpeg", quality: int = 85) -> Picture:
    """Return the picture of an image.

    Args:
        image: blue, green, red.
        name: unique among the pictures of an observation.
        title: one line.
        format_: of the file.
        quality: of JPEG and WebP, 1 to 100.
    """
    flags = {
        "jpeg": [cv2.IMWRITE_JPEG_QUALITY, quality],
        "webp": [cv2.IMWRITE_WEBP_QUALITY, quality],
        "png": [cv2.IMWRITE_PNG_COMPRESSION, _PNG_EFFORT],
    }
    _, buffer = cv2.imencode(f".{format_}", image, flags[format_])  # it raises an exception on failure
    data = buffer.tobytes()
    height, width = image.shape[:2]
    return Picture(name, title, MEDIA_TYPES[format_], data, width, height, hashlib.sha256(data).hexdigest())
